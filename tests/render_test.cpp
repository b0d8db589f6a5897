#include <Imath/ImathMatrix.h>
#include <doctest/doctest.h>

#include <CLI/CLI.hpp>
#include <array>
#include <cmath>
#include <fstream>
#include <functional>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "clarus/error.h"
#include "clarus/jitter.h"
#include "cli/commands.h"
#include "io/file.h"
#include "io/sequence.h"
#include "render/renderer.h"
#include "render/sequence_writer.h"
#include "render/worlds/camera_path.h"
#include "render/worlds/demo_scene.h"
#include "temporary_folder.h"

using namespace clarus;
using namespace clarus::render;
using Imath::M44d;
using Imath::V2d;
using Imath::V3d;
using Imath::V3f;

namespace {

constexpr Size render_size{48, 32};
constexpr double pi = std::numbers::pi;

M44d rotation(V3d angles) {
    M44d matrix;
    matrix.rotate(angles);
    return matrix;
}

M44d translation(V3d by) {
    M44d matrix;
    matrix.setTranslation(by);
    return matrix;
}

double focal(const CameraPose& pose) { return render_size.height / 2.0 / std::tan(pose.fov_y / 2); }

/// Row vectors; camera space looks along −z.
M44d camera_to_world(const CameraPose& pose) {
    return rotation({0, 0, -pose.roll}) * rotation({pose.pitch, 0, 0}) * rotation({0, -pose.yaw, 0}) *
           translation(pose.position);
}

V2d project(const CameraPose& pose, V3d world) {
    const V3d p = world * camera_to_world(pose).inverse();
    return {render_size.width / 2.0 + focal(pose) * p.x / -p.z, render_size.height / 2.0 - focal(pose) * p.y / -p.z};
}

/// A square of side 4 around the object's origin in its xy plane.
constexpr float half_side = 2;

/// What a pixel position sees of the square: the point in object space and its view distance.
struct Seen {
    V3d point;
    double view_distance;
};

std::optional<Seen> look(const CameraPose& pose, V2d pixel, const M44d& object_to_world) {
    const V3d ray((pixel.x - render_size.width / 2.0) / focal(pose), (render_size.height / 2.0 - pixel.y) / focal(pose),
                  -1);
    const M44d to_object = camera_to_world(pose) * object_to_world.inverse();
    V3d direction;
    to_object.multDirMatrix(ray, direction);
    const V3d origin = V3d(0) * to_object;
    const double t = -origin.z / direction.z;
    const V3d point = origin + direction * t;
    // Where an edge is nearer than rounding, nothing is expected.
    if (t <= 0 || std::max(std::abs(point.x), std::abs(point.y)) > half_side - 1e-3) return std::nullopt;
    return Seen{point, t};
}

std::shared_ptr<const Texture> white() {
    return std::make_shared<Texture>(2, [](float, float) { return Rgba{1, 1, 1, 1}; });
}

using Motion = std::function<M44d(double)>;

/// The square alone under a plain sky; `motion` empty for a static one in the plane z = 0.
std::unique_ptr<Scene> square_scene(const Motion& motion) {
    auto scene = std::make_unique<Scene>();
    scene->environment.clouds = white();
    Mesh square;
    square.material = scene->add_material({.texture = white()});
    square.add_quad({V3f(-half_side, -half_side, 0),
                     {half_side, -half_side, 0},
                     {half_side, half_side, 0},
                     {-half_side, half_side, 0}},
                    Imath::V2f(0), Imath::V2f(1));
    if (motion) {
        scene->add_moving({square}, motion);
    } else {
        scene->add_static({square});
    }
    scene->build();
    return scene;
}

RenderSettings small_settings() {
    RenderSettings settings;
    settings.render_size = render_size;
    settings.output_size = {2 * render_size.width, 2 * render_size.height};
    settings.reference_grid = 0;
    return settings;
}

CameraPose in_front(double distance) {
    CameraPose pose;
    pose.position = {0, 0, distance};
    return pose;
}

constexpr double now = 1, before = 0.9;

/// Renders the square and checks depth and motion of every pixel that sees it against this file's own arithmetic.
void check_vectors(const CameraPose& camera, const CameraPose& previous_camera, const Motion& motion,
                   bool motion_at_centre = false) {
    const auto scene = square_scene(motion);
    RenderSettings settings = small_settings();
    settings.motion_at_centre = motion_at_centre;
    const Vec2 jitter{0.3125f, -0.4375f};
    const RenderedFrame frame = render_frame(*scene, {camera, previous_camera, now, before}, jitter, settings);
    const M44d place = motion ? motion(now) : M44d(), previous_place = motion ? motion(before) : M44d();
    int seen_pixels = 0;
    double worst = 0, worst_depth = 0;
    for (int y = 0; y < render_size.height; ++y) {
        for (int x = 0; x < render_size.width; ++x) {
            const V2d centre(x + 0.5, y + 0.5), jittered = centre + V2d(jitter.x, jitter.y);
            if (const auto seen = look(camera, jittered, place)) {
                worst_depth = std::max(worst_depth, std::abs(frame.depth.at(x, y, 0) -
                                                             std::min(1.0, seen->view_distance / settings.far_plane)));
            }
            const V2d sample = motion_at_centre ? centre : jittered;
            if (const auto seen = look(camera, sample, place)) {
                const V2d expected = project(previous_camera, seen->point * previous_place) - sample;
                const V2d vector(frame.motion.at(x, y, 0), frame.motion.at(x, y, 1));
                worst = std::max(worst, (vector - expected).length());
                ++seen_pixels;
            }
        }
    }
    CHECK(seen_pixels > 100);
    CHECK(worst < 1e-3);
    CHECK(worst_depth < 1e-6);
}

std::array<float, 2> motion_in_the_middle(const RenderedFrame& frame) {
    const int x = render_size.width / 2, y = render_size.height / 2;
    return {frame.motion.at(x, y, 0), frame.motion.at(x, y, 1)};
}

double psnr(const io::Pixels& a, const io::Pixels& b) {
    double squares = 0;
    for (size_t i = 0; i < a.values.size(); ++i) squares += std::pow(double{a.values[i]} - b.values[i], 2);
    return -10 * std::log10(squares / static_cast<double>(a.values.size()));
}

/// Runs `clarus render` with these arguments.
void run_command(std::vector<std::string> arguments) {
    CLI::App app;
    cli::add_render_command(app);
    arguments.insert(arguments.begin(), "render");
    std::ranges::reverse(arguments);
    app.parse(arguments);
}

std::vector<std::string> tiny_render(const std::filesystem::path& folder) {
    return {"--size", "24x16", "--frames", "2", "--reference-samples", "1", "-o", folder.string()};
}

}  // namespace

TEST_CASE("Halton jitter is the sequence of conventions.md") {
    const auto check = [](int frame, double x, double y) {
        CHECK(halton_jitter(frame, 16).x == doctest::Approx(x));
        CHECK(halton_jitter(frame, 16).y == doctest::Approx(y));
    };
    check(0, 1.0 / 2 - 0.5, 1.0 / 3 - 0.5);
    check(1, 1.0 / 4 - 0.5, 2.0 / 3 - 0.5);
    check(2, 3.0 / 4 - 0.5, 1.0 / 9 - 0.5);
    check(5, 3.0 / 8 - 0.5, 2.0 / 9 - 0.5);      // 6: 110 and 20
    check(15, 1.0 / 32 - 0.5, 16.0 / 27 - 0.5);  // 16: 10000 and 121
    check(16, 0, 1.0 / 3 - 0.5);
    CHECK(halton_jitter(7, 3) == halton_jitter(1, 3));
}

TEST_CASE("motion vectors point to where a static surface was") {
    SUBCASE("the camera moves") {
        for (int axis = 0; axis < 3; ++axis) {
            for (const double step : {-0.13, 0.13}) {
                CameraPose previous = in_front(3.3);
                previous.position[axis] += step;
                CAPTURE(axis);
                CAPTURE(step);
                check_vectors(in_front(3.3), previous, {});
            }
        }
    }
    SUBCASE("the camera turns") {
        for (double CameraPose::*angle : {&CameraPose::yaw, &CameraPose::pitch, &CameraPose::roll}) {
            for (const double step : {-0.05, 0.05}) {
                CameraPose camera = in_front(3.3), previous = camera;
                previous.*angle += step;
                CAPTURE(step);
                check_vectors(camera, previous, {});
            }
        }
    }
    SUBCASE("all at once, from an odd place, sampled at centres too") {
        CameraPose camera{{-1.1, 0.7, 2.6}, 0.4, -0.25, 0.3, 0.9}, previous{{-1.2, 0.75, 2.7}, 0.37, -0.22, 0.33, 0.95};
        check_vectors(camera, previous, {});
        check_vectors(camera, previous, {}, true);
    }
}

TEST_CASE("motion vectors follow moving and spinning objects") {
    for (int axis = 0; axis < 3; ++axis) {
        for (const double rate : {-1.7, 1.7}) {
            CAPTURE(axis);
            CAPTURE(rate);
            V3d unit(0);
            unit[axis] = rate;
            check_vectors(in_front(4), in_front(4), [=](double t) { return translation(unit * t); });
            // Turned so that it is not seen edge on at either time.
            check_vectors(in_front(4), in_front(4), [=](double t) {
                return rotation(unit * (t - 0.8)) * translation({0.2, -0.1, 0});
            });
        }
    }
    CameraPose previous = in_front(4.2);
    previous.yaw = 0.04;
    check_vectors(in_front(4), previous, [](double t) {
        return rotation({0.3 * t, 0.8 * t, 5 * t}) * translation({t, -0.6 * t, 0.5 * t});
    });
}

TEST_CASE("motion vectors have the signs of conventions.md") {
    const auto scene = square_scene({});
    const RenderSettings settings = small_settings();
    CameraPose camera = in_front(5), previous = camera;
    const float pixels_a_metre = static_cast<float>(focal(camera) / 5);
    SUBCASE("the camera went right: things were further right before") {
        previous.position.x -= 0.1;
        const auto [x, y] = motion_in_the_middle(render_frame(*scene, {camera, previous, 0, 0}, {}, settings));
        CHECK(x == doctest::Approx(0.1f * pixels_a_metre).epsilon(1e-4));
        CHECK(y == doctest::Approx(0).epsilon(1e-4));
    }
    SUBCASE("the camera went up: things were further up, at smaller y, before") {
        previous.position.y -= 0.1;
        const auto [x, y] = motion_in_the_middle(render_frame(*scene, {camera, previous, 0, 0}, {}, settings));
        CHECK(x == doctest::Approx(0).epsilon(1e-4));
        CHECK(y == doctest::Approx(-0.1f * pixels_a_metre).epsilon(1e-4));
    }
}

TEST_CASE("the sky moves with the camera's rotation alone, and has depth 1") {
    const auto scene = square_scene({});
    CameraPose camera = in_front(5), previous = camera;
    camera.yaw = previous.yaw = pi;  // the square is behind
    previous.position += V3d(1, 2, 3);
    RenderedFrame frame = render_frame(*scene, {camera, previous, 0, 0}, {}, small_settings());
    for (const float value : frame.motion.values) CHECK(std::abs(value) < 1e-6f);
    for (const float value : frame.depth.values) CHECK(value == 1);

    previous.yaw -= 0.02;  // the camera turned right, so what it sees came from the right
    frame = render_frame(*scene, {camera, previous, 0, 0}, {}, small_settings());
    const V2d middle(render_size.width / 2 + 0.5, render_size.height / 2 + 0.5);
    const double column = middle.x - render_size.width / 2.0;
    const double expected = focal(camera) * std::tan(std::atan(column / focal(camera)) + 0.02) - column;
    CHECK(motion_in_the_middle(frame)[0] == doctest::Approx(expected).epsilon(1e-3));
}

TEST_CASE("depth is the view distance over the far plane") {
    const auto scene = square_scene({});
    RenderSettings settings = small_settings();
    settings.far_plane = 40;
    const CameraPose camera = in_front(2);
    const RenderedFrame frame = render_frame(*scene, {camera, camera, 0, 0}, {0.25f, 0.25f}, settings);
    // A plane that faces the camera: the same depth in the middle and in the corners.
    for (const float value : frame.depth.values) CHECK(value == doctest::Approx(2.0 / 40).epsilon(1e-5));
}

TEST_CASE("what was behind the camera has an invalid vector") {
    const auto scene = square_scene({});
    CameraPose camera = in_front(0.5), previous = in_front(-0.5);
    const RenderedFrame frame = render_frame(*scene, {camera, previous, 0, 0}, {}, small_settings());
    const auto [x, y] = motion_in_the_middle(frame);
    CHECK(std::isfinite(x));
    CHECK(std::hypot(x, y) > std::hypot(render_size.width, render_size.height));
}

TEST_CASE("a texture's levels are means of its texels, and it repeats") {
    const auto value = [](float u, float v) { return Rgba{u < 0.5f ? 0.81f : 0.25f, v < 0.5f ? 1.0f : 0.0f, 0.5f, 1}; };
    const Texture texture(2, value);
    constexpr float rounding = 0.008f;  // 8 bits of a square root
    const auto check = [&](Imath::V2f uv, float level, V3f expected) {
        const Imath::V4f sample = texture.sample(uv, level);
        CAPTURE(level);
        for (int channel = 0; channel < 3; ++channel) CHECK(std::abs(sample[channel] - expected[channel]) < rounding);
    };
    check({0.125f, 0.875f}, 0, {0.81f, 0, 0.5f});
    check({1.125f, -0.125f}, -3, {0.81f, 0, 0.5f});
    check({0.5f, 0.625f}, 0, {0.53f, 0, 0.5f});   // between two texels
    check({0.3f, 0.9f}, 2, {0.53f, 0.5f, 0.5f});  // one texel is left
    check({0.3f, 0.9f}, 9, {0.53f, 0.5f, 0.5f});
    check({0.25f, 0.25f}, 1.5f, {0.67f, 0.75f, 0.5f});  // half of a 2 by 2 level, half of the last one
}

TEST_CASE("a cut-out surface is there where its texture is, for the camera and for the sun") {
    // Nothing in the square's left half; a floor below, the sun straight above.
    Scene scene;
    scene.environment.clouds = white();
    scene.environment.sun = V3f(1);
    const auto half = std::make_shared<Texture>(4, [](float u, float) {
        return Rgba{1, 1, 1, u < 0.5f ? 0.0f : 1.0f};
    });
    Mesh card, floor;
    card.material = scene.add_material({.texture = half, .cutout = true});
    floor.material = scene.add_material({.texture = white()});
    card.add_quad({V3f(-1, 1, 1), {1, 1, 1}, {1, 1, -1}, {-1, 1, -1}}, Imath::V2f(0), Imath::V2f(1));
    floor.add_quad({V3f(-9, 0, 9), {9, 0, 9}, {9, 0, -9}, {-9, 0, -9}}, Imath::V2f(0), Imath::V2f(1));
    scene.add_static({card, floor});
    scene.build();
    RenderSettings settings = small_settings();
    settings.hdr = true;
    CameraPose camera;
    camera.pitch = -pi / 2;
    const auto middle_row = [&](double height) {
        camera.position = {0, height, 0};
        const RenderedFrame frame = render_frame(scene, {camera, camera, 0, 0}, {}, settings);
        const int y = render_size.height / 2, x = render_size.width / 2;
        return std::array{frame.depth.at(x - 3, y, 0) * settings.far_plane,
                          frame.depth.at(x + 3, y, 0) * settings.far_plane, frame.color.at(x - 3, y, 0),
                          frame.color.at(x + 3, y, 0)};
    };
    const auto from_above = middle_row(4), from_below = middle_row(0.9);
    CHECK(from_above[0] == doctest::Approx(4));
    CHECK(from_above[1] == doctest::Approx(3));
    CHECK(from_below[0] == doctest::Approx(0.9));
    // No sky light is set: the floor is lit by the sun, or not at all.
    CHECK(from_below[2] > 0.9f);
    CHECK(from_below[3] == 0);
}

TEST_CASE("the jittered frames of a still stretch average to the reference") {
    constexpr int path_number = 1, first_still = 25, points = 16;
    const CameraPath path(path_number);
    const auto scene = make_demo_scene(path_number, path);
    RenderSettings settings = small_settings();
    settings.render_size = {96, 54};
    settings.output_size = {192, 108};
    settings.hdr = true;
    settings.mip_bias = -3;  // a colour sample's share of a pixel is then that of a reference sample
    io::Pixels mean{settings.render_size, 3, {}};
    mean.values.resize(96 * 54 * 3);
    const auto tone_mapped = [](float radiance) { return radiance / (1 + radiance); };
    const FrameState still = path.frame(first_still);
    CHECK(still.camera.position == still.previous_camera.position);
    CHECK(still.seconds == still.previous_seconds);
    for (int i = 0; i < points; ++i) {
        const RenderedFrame frame = render_frame(*scene, still, halton_jitter(i, points), settings);
        for (size_t k = 0; k < mean.values.size(); ++k) {
            mean.values[k] += tone_mapped(frame.color.values[k]) / points;
        }
    }
    settings.reference_grid = 4;
    const RenderedFrame frame = render_frame(*scene, still, {}, settings);
    io::Pixels pooled{settings.render_size, 3, {}};
    for (int y = 0; y < 54; ++y) {
        for (int x = 0; x < 96; ++x) {
            for (int channel = 0; channel < 3; ++channel) {
                float sum = 0;
                for (int i = 0; i < 4; ++i) {
                    sum += tone_mapped(frame.reference.at(2 * x + i % 2, 2 * y + i / 2, channel));
                }
                pooled.values.push_back(sum / 4);
            }
        }
    }
    CHECK(psnr(mean, pooled) > 35);
}

TEST_CASE("a path moves, stands still and moves again") {
    for (const int number : {0, 1, 2}) {
        const CameraPath path(number);
        int still = 0, moving = 0, objects_still = 0;
        for (int frame = 0; frame < 192; ++frame) {
            const FrameState state = path.frame(frame);
            const CameraPose &a = state.camera, &b = state.previous_camera;
            const bool stands = a.position == b.position && a.yaw == b.yaw && a.pitch == b.pitch;
            ++(stands ? still : moving);
            if (state.seconds == state.previous_seconds) {
                CHECK(stands);
                ++objects_still;
            }
            // The frame before is the frame before.
            CHECK(path.frame(frame + 1).previous_camera.position == a.position);
            CHECK(path.frame(frame + 1).previous_seconds == state.seconds);
        }
        CHECK(still == 64);
        CHECK(moving == 128);
        CHECK(objects_still == 32);
    }
}

TEST_CASE("the same frame has the same values every time, another path others") {
    const auto render = [](int number, int frame) {
        const CameraPath path(number);
        const auto scene = make_demo_scene(number, path);
        RenderSettings settings = small_settings();
        settings.reference_grid = 1;
        return render_frame(*scene, path.frame(frame), halton_jitter(frame, 16), settings);
    };
    const RenderedFrame first = render(4, 3), again = render(4, 3), other = render(5, 3);
    CHECK(first.color.values == again.color.values);
    CHECK(first.depth.values == again.depth.values);
    CHECK(first.motion.values == again.motion.values);
    CHECK(first.reference.values == again.reference.values);
    CHECK(first.color.values != other.color.values);
}

TEST_CASE("clarus render writes a sequence that the readers take, the same each time") {
    const TemporaryFolder folder;
    run_command(tiny_render(folder / "a"));
    run_command(tiny_render(folder / "b"));
    const io::Sequence sequence = io::read_sequence(folder / "a");
    CHECK(sequence.render_size == Size{24, 16});
    CHECK(sequence.scale == 2);
    CHECK(sequence.motion.sampled_at_jitter);
    REQUIRE(sequence.frames.size() == 2);
    CHECK(sequence.frames[0].reset);
    CHECK(!sequence.frames[1].reset);
    CHECK(sequence.frames[1].jitter == halton_jitter(1, 16));
    CHECK(io::read_image_header(sequence.frames[1].color).size == Size{24, 16});
    CHECK(io::read_image_header(sequence.frames[1].depth).channels == 1);
    CHECK(io::read_image_header(sequence.frames[1].motion).channels == 2);
    CHECK(io::read_image_header(sequence.frames[1].reference).size == Size{48, 32});
    for (const char* name : {"sequence.json", "color/0001.png", "reference/0001.png"}) {
        CAPTURE(name);
        CHECK(io::read_file(folder / "a" / name) == io::read_file(folder / "b" / name));
    }
    // EXR files carry the time at which they were written.
    for (const char* name : {"depth/0001.exr", "motion/0001.exr"}) {
        CAPTURE(name);
        CHECK(io::read_image(folder / "a" / name).values == io::read_image(folder / "b" / name).values);
    }

    // A later start shows the same frames; an existing sequence is kept unless --force says otherwise.
    auto later = tiny_render(folder / "b");
    later.insert(later.end(), {"--first-frame", "1"});
    CHECK_THROWS_WITH_AS(run_command(later), doctest::Contains("--force"), Error);
    CHECK(io::read_sequence(folder / "b").frames.size() == 2);
    later.push_back("--force");
    run_command(later);
    CHECK(io::read_file(folder / "b" / "color/0000.png") == io::read_file(folder / "a" / "color/0001.png"));
}

TEST_CASE("a render that fails takes its files with it") {
    const TemporaryFolder folder;
    const std::filesystem::path place = folder / "sequence", obstacle = place / "depth" / "0001.exr";
    std::filesystem::create_directories(obstacle / "kept");
    CHECK_THROWS_WITH_AS(run_command(tiny_render(place)), doctest::Contains("0001.exr"), Error);
    size_t left = 0;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(place)) left += !entry.is_directory();
    CHECK(left == 0);
    CHECK(std::filesystem::exists(obstacle / "kept"));
    CHECK(!std::filesystem::exists(place / "color"));
}

TEST_CASE("clarus render writes linear radiance, other scales, motion at centres, no jitter") {
    const TemporaryFolder folder;
    auto arguments = tiny_render(folder / "hdr");
    arguments.insert(arguments.end(), {"--hdr", "--scale", "1.5", "--motion-at", "centre", "--jitter", "none"});
    run_command(arguments);
    const io::Sequence hdr = io::read_sequence(folder / "hdr");
    CHECK(hdr.color_space == ColorSpace::linear);
    CHECK(!hdr.motion.sampled_at_jitter);
    CHECK(hdr.frames[1].jitter == Vec2{});
    CHECK(io::read_image_header(hdr.frames[1].reference).size == Size{36, 24});
}

TEST_CASE("clarus render refuses bad input before it makes anything") {
    const TemporaryFolder folder;
    const std::filesystem::path place = folder / "sequence";
    const auto refused = [&](const char* option, const char* value, const char* named) {
        CAPTURE(option);
        CAPTURE(value);
        auto arguments = tiny_render(place);
        arguments.insert(arguments.end(), {option, value});
        // The last one given counts.
        const auto first = std::ranges::find(arguments, option);
        if (first + 2 != arguments.end()) arguments.erase(first, first + 2);
        CHECK_THROWS_WITH_AS(run_command(arguments), doctest::Contains(named), Error);
        CHECK(!std::filesystem::exists(place));
    };
    for (const char* size : {"24", "24x", "x16", "0x16", "24x-1", "24x16x3", "99999x2"})
        refused("--size", size, "--size");
    for (const char* scale : {"1", "2.5", "7", "-2"}) refused("--scale", scale, "--scale");
    for (const char* samples : {"0", "5", "-4"}) refused("--reference-samples", samples, "--reference-samples");
    for (const char* jitter : {"halton", "halton:0", "random"}) refused("--jitter", jitter, "--jitter");
    refused("--frames", "0", "--frames");
    refused("--first-frame", "-1", "--first-frame");
    refused("--path", "-1", "--path");
    refused("--motion-at", "corner", "--motion-at");
    refused("--scene", "office", "office");
    // A folder where a file stands in the way.
    std::ofstream(place) << "a file";
    CHECK_THROWS_WITH_AS(run_command(tiny_render(place)), doctest::Contains(place.c_str()), Error);
    CHECK(std::filesystem::is_regular_file(place));
}
