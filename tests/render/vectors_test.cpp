#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "clarus/jitter.h"
#include "render/sequence_writer.h"
#include "render_harness.h"
#include "temporary_folder.h"

using namespace clarus;
using namespace clarus::render;
using namespace clarus::render_test;
using Imath::M44d;
using Imath::V2d;
using Imath::V3d;

namespace {

constexpr double pi = std::numbers::pi;
constexpr Size render_size{48, 32};
constexpr float half_side = 2;

/// What a pixel position sees of the square: the point in object space and its view distance.
struct Seen {
    V3d point;
    double view_distance;
};

std::optional<Seen> look(const CameraPose& pose, V2d pixel, const M44d& object_to_world) {
    const double f = focal(pose, render_size);
    const V3d ray((pixel.x - render_size.width / 2.0) / f, (render_size.height / 2.0 - pixel.y) / f, -1);
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

/// The square alone under a plain sky; `motion` empty for a static one in the plane z = 0.
std::unique_ptr<Scene> square_scene(const Motion& motion) {
    auto scene = std::make_unique<Scene>();
    scene->environment = even_light();
    const Mesh mesh = square(scene->add_material({.texture = plain()}), half_side);
    if (motion) {
        scene->add_moving({mesh}, motion);
    } else {
        scene->add_static({mesh});
    }
    scene->build();
    return scene;
}

constexpr double now = 1, before = 0.9;
constexpr Vec2 jitter{0.3125f, -0.4375f}, previous_jitter{-0.25f, 0.125f};

/// The two cameras and the motion of the square, the same in every check.
struct Movement {
    CameraPose camera, previous_camera;
    Motion motion;

    FrameState frame() const { return {camera, previous_camera, now, before}; }
    M44d place(double time) const { return motion ? motion(time) : M44d(); }
};

/// Compares depth and motion of every pixel that sees the square with this file's own arithmetic.
void check_images(const Movement& movement, const io::Pixels& depth, const io::Pixels& motion, bool motion_at_centre,
                  float far_plane) {
    int seen_pixels = 0;
    double worst = 0, worst_depth = 0;
    for (int y = 0; y < render_size.height; ++y) {
        for (int x = 0; x < render_size.width; ++x) {
            const V2d centre(x + 0.5, y + 0.5), jittered = centre + V2d(jitter.x, jitter.y);
            if (const auto seen = look(movement.camera, jittered, movement.place(now))) {
                worst_depth =
                    std::max(worst_depth, std::abs(depth.at(x, y, 0) - std::min(1.0, seen->view_distance / far_plane)));
            }
            const V2d sample = motion_at_centre ? centre : jittered;
            if (const auto seen = look(movement.camera, sample, movement.place(now))) {
                const V3d point = seen->point * movement.place(before);
                const V2d expected = project(movement.previous_camera, point, render_size) - sample;
                const V2d vector(motion.at(x, y, 0), motion.at(x, y, 1));
                worst = std::max(worst, (vector - expected).length());
                ++seen_pixels;
            }
        }
    }
    CHECK(seen_pixels > 100);
    CHECK(worst < 1e-3);
    CHECK(worst_depth < 1e-6);
}

/// As square_scene, but that the square's vertices move.
std::unique_ptr<Scene> deforming_scene(const Motion& motion) {
    auto scene = std::make_unique<Scene>();
    scene->environment = even_light();
    const Mesh mesh = square(scene->add_material({.texture = plain()}), half_side);
    scene->add_deforming(mesh, [motion, rest = mesh.positions](double seconds, std::span<Imath::V3f> positions) {
        for (size_t i = 0; i < positions.size(); ++i) positions[i] = Imath::V3f(V3d(rest[i]) * motion(seconds));
    });
    scene->build();
    return scene;
}

void check_vectors(const Movement& movement, bool motion_at_centre = false) {
    const auto scene = square_scene(movement.motion);
    RenderSettings settings = small_settings();
    settings.motion_at_centre = motion_at_centre;
    const RenderedFrame frame = render_frame(*scene, movement.frame(), jitter, settings);
    check_images(movement, frame.depth, frame.motion, motion_at_centre, settings.far_plane);
}

/// Every axis and sign, of the camera and of the square.
template <typename Check>
void for_each_movement(const Check& check) {
    for (int axis = 0; axis < 3; ++axis) {
        for (const double sign : {-1, 1}) {
            CAPTURE(axis);
            CAPTURE(sign);
            CameraPose camera = in_front(3.3), moved = camera, turned = camera;
            moved.position[axis] += 0.13 * sign;
            turned.*std::array{&CameraPose::pitch, &CameraPose::yaw, &CameraPose::roll}[axis] += 0.05 * sign;
            check(Movement{camera, moved, {}});
            check(Movement{camera, turned, {}});
            V3d rate(0);
            rate[axis] = 1.7 * sign;
            camera = in_front(4);
            check(Movement{camera, camera, [=](double t) { return translation(rate * t); }});
            // Turned so that it is not seen edge on at either time.
            check(Movement{camera, camera, [=](double t) {
                               return rotation(rate * (t - 0.8)) * translation({0.2, -0.1, 0});
                           }});
        }
    }
}

std::array<float, 2> motion_in_the_middle(const RenderedFrame& frame) {
    const int x = render_size.width / 2, y = render_size.height / 2;
    return {frame.motion.at(x, y, 0), frame.motion.at(x, y, 1)};
}

}  // namespace

TEST_CASE("motion vectors point to where the surface was, for every axis and sign") {
    for_each_movement([](const Movement& movement) { check_vectors(movement); });
}

TEST_CASE("motion vectors are right with everything moving at once, from odd places, at pixel centres too") {
    const CameraPose camera{{-1.1, 0.7, 2.6}, 0.4, -0.25, 0.3, 0.9},
        previous{{-1.2, 0.75, 2.7}, 0.37, -0.22, 0.33, 0.95};
    for (const bool at_centre : {false, true}) check_vectors({camera, previous, {}}, at_centre);
    CameraPose turned = in_front(4.2);
    turned.yaw = 0.04;
    const auto tumbling = [](double t) {
        return rotation({0.3 * t, 0.8 * t, 5 * t}) * translation({t, -0.6 * t, 0.5 * t});
    };
    for (const bool at_centre : {false, true}) check_vectors({in_front(4), turned, tumbling}, at_centre);
}

TEST_CASE("motion vectors of a mesh that changes its shape are those of its vertices' places") {
    const auto check = [](const Movement& movement) {
        if (!movement.motion) return;
        const auto scene = deforming_scene(movement.motion);
        const RenderedFrame frame = render_frame(*scene, movement.frame(), jitter, small_settings());
        check_images(movement, frame.depth, frame.motion, false, small_settings().far_plane);
        // The time before must leave no trace.
        render_frame(*scene, {movement.camera, movement.camera, 5, 4}, jitter, small_settings());
        const RenderedFrame again = render_frame(*scene, movement.frame(), jitter, small_settings());
        CHECK(again.color.values == frame.color.values);
        CHECK(again.motion.values == frame.motion.values);
    };
    for_each_movement(check);
    const auto sheared_and_stretched = [](double t) {
        return M44d(1 + 0.3 * t, 0.2 * t, 0, 0, -0.4 * t, 1 - 0.2 * t, 0.1 * t, 0, 0, 0, 1, 0, 0.1, 0.2, 0.3 * t, 1);
    };
    check({in_front(4), in_front(4.1), sheared_and_stretched});
}

TEST_CASE("what the readers give back of jittered vectors is as exact, wherever they are sampled") {
    const TemporaryFolder folder;
    int number = 0;
    for_each_movement([&](const Movement& movement) {
        const bool at_centre = number % 2 == 0;
        RenderSettings settings = small_settings();
        settings.motion_at_centre = at_centre;
        io::Sequence sequence;
        sequence.render_size = render_size;
        sequence.motion = {.jittered = true, .sampled_at_jitter = !at_centre};
        const auto place = folder / std::to_string(number++);
        const auto scene = square_scene(movement.motion);
        SequenceWriter writer(io::output_layout(place, io::Layout::native), sequence, settings, {}, false);
        for (const Vec2 j : {previous_jitter, jitter}) {
            io::FrameFiles frame;
            frame.jitter = j;
            writer.add(frame, [&] { return render_frame(*scene, movement.frame(), j, settings); });
        }
        writer.finish();
        const io::Sequence read = io::read_sequence(place);
        CHECK(read.motion.jittered);
        const io::FramePixels frame = read_canonical(read, 1);
        check_images(movement, frame.depth, frame.motion, !read.motion.sampled_at_jitter, settings.far_plane);
        // With the jitter inside, which is large enough to tell.
        const io::FramePixels raw = io::read_frame(read, 1, true, false);
        CHECK(raw.motion.at(24, 16, 0) - frame.motion.at(24, 16, 0) == doctest::Approx(jitter.x - previous_jitter.x));
        CHECK(raw.motion.at(24, 16, 1) - frame.motion.at(24, 16, 1) == doctest::Approx(jitter.y - previous_jitter.y));
    });
}

TEST_CASE("motion vectors have the signs of docs/conventions.md") {
    const auto scene = square_scene({});
    const RenderSettings settings = small_settings();
    CameraPose camera = in_front(5), previous = camera;
    const float pixels_a_metre = static_cast<float>(focal(camera, render_size) / 5);
    SUBCASE("the camera went right: things were further right before") {
        previous.position.x -= 0.1;
        const auto [x, y] = motion_in_the_middle(render_frame(*scene, {camera, previous}, {}, settings));
        CHECK(x == doctest::Approx(0.1f * pixels_a_metre).epsilon(1e-4));
        CHECK(y == doctest::Approx(0).epsilon(1e-4));
    }
    SUBCASE("the camera went up: things were further up, at smaller y, before") {
        previous.position.y -= 0.1;
        const auto [x, y] = motion_in_the_middle(render_frame(*scene, {camera, previous}, {}, settings));
        CHECK(x == doctest::Approx(0).epsilon(1e-4));
        CHECK(y == doctest::Approx(-0.1f * pixels_a_metre).epsilon(1e-4));
    }
}

TEST_CASE("the sky moves with the camera's rotation alone, and has depth 1") {
    const auto scene = square_scene({});
    CameraPose camera = in_front(5), previous = camera;
    camera.yaw = previous.yaw = pi;  // the square is behind
    previous.position += V3d(1, 2, 3);
    RenderedFrame frame = render_frame(*scene, {camera, previous}, {}, small_settings());
    for (const float value : frame.motion.values) CHECK(std::abs(value) < 1e-6f);
    for (const float value : frame.depth.values) CHECK(value == 1);

    previous.yaw -= 0.02;  // the camera turned right, so what it sees came from the right
    frame = render_frame(*scene, {camera, previous}, {}, small_settings());
    const double f = focal(camera, render_size), column = 0.5;  // of the pixel right of the middle
    CHECK(motion_in_the_middle(frame)[0] ==
          doctest::Approx(f * std::tan(std::atan(column / f) + 0.02) - column).epsilon(1e-3));
}

TEST_CASE("depth is the view distance over the far plane") {
    const auto scene = square_scene({});
    RenderSettings settings = small_settings();
    settings.far_plane = 40;
    const CameraPose camera = in_front(2);
    const RenderedFrame frame = render_frame(*scene, {camera, camera}, {0.25f, 0.25f}, settings);
    // A plane that faces the camera: the same depth in the middle and in the corners.
    for (const float value : frame.depth.values) CHECK(value == doctest::Approx(2.0 / 40).epsilon(1e-5));
}

TEST_CASE("what was behind the camera has an invalid vector") {
    const auto scene = square_scene({});
    const RenderedFrame frame = render_frame(*scene, {in_front(0.5), in_front(-0.5)}, {}, small_settings());
    const auto [x, y] = motion_in_the_middle(frame);
    CHECK(std::isfinite(x));
    CHECK(std::hypot(x, y) > std::hypot(render_size.width, render_size.height));
}

TEST_CASE("depth and motion at output resolution are those of the output's pixel centres, in render pixels") {
    const Movement movement{in_front(3.3), {{0.1, -0.05, 3.4}, 0.02, 0.01, 0.03, 1.02}, {}};
    const auto scene = square_scene({});
    RenderSettings settings = small_settings();
    settings.output_buffers = true;
    const RenderedFrame frame = render_frame(*scene, movement.frame(), jitter, settings);
    REQUIRE(frame.output_motion.size == settings.output_size);
    REQUIRE(frame.aliased.size == settings.output_size);
    double worst = 0, worst_depth = 0;
    int seen_pixels = 0;
    for (int y = 0; y < settings.output_size.height; ++y) {
        for (int x = 0; x < settings.output_size.width; ++x) {
            const V2d point((x + 0.5) / 2, (y + 0.5) / 2);
            const auto seen = look(movement.camera, point, M44d());
            if (!seen) continue;
            ++seen_pixels;
            const V2d expected = project(movement.previous_camera, seen->point, render_size) - point;
            const V2d vector(frame.output_motion.at(x, y, 0), frame.output_motion.at(x, y, 1));
            worst = std::max(worst, (vector - expected).length());
            worst_depth = std::max(worst_depth,
                                   std::abs(frame.output_depth.at(x, y, 0) - seen->view_distance / settings.far_plane));
        }
    }
    CHECK(seen_pixels > 1000);
    CHECK(worst < 1e-3);
    CHECK(worst_depth < 1e-6);
}

TEST_CASE("a camera's matrices take a point to its pixel and its depth buffer's value") {
    const CameraPose pose{{-1.1, 0.7, 2.6}, 0.4, -0.25, 0.3, 0.9};
    const double n = 0.1, f = 90;
    const V3d point(0.3, 0.2, -1);
    for (const bool reversed : {false, true}) {
        const FrameDescription::Camera camera = Camera(pose, render_size).matrices(n, f, reversed);
        CHECK(camera.fov_y == doctest::Approx(0.9));
        std::array<double, 4> vector{point.x, point.y, point.z, 1};
        for (const auto& matrix : {camera.view, camera.projection}) {
            std::array<double, 4> product{};
            for (size_t i = 0; i < 16; ++i) product[i / 4] += matrix[i] * vector[i % 4];
            vector = product;
        }
        const V2d pixel = project(pose, point, render_size);
        const double z = -(point * camera_to_world(pose).inverse()).z;
        CHECK(vector[3] == doctest::Approx(z));
        CHECK((vector[0] / vector[3] + 1) / 2 * render_size.width == doctest::Approx(pixel.x).epsilon(1e-4));
        CHECK((1 - vector[1] / vector[3]) / 2 * render_size.height == doctest::Approx(pixel.y).epsilon(1e-4));
        const double v = vector[2] / vector[3];
        CHECK((reversed ? n * f / (n + v * (f - n)) : n * f / (f - v * (f - n))) == doctest::Approx(z).epsilon(1e-3));
    }
}
