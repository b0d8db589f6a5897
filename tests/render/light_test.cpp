#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <numbers>

#include "render_harness.h"

using namespace clarus;
using namespace clarus::render;
using namespace clarus::render_test;
using Imath::V2f;
using Imath::V3d;
using Imath::V3f;

namespace {

constexpr double pi = std::numbers::pi;
constexpr float even = 0.55f;  // radiance of a white surface in even_light

RenderSettings radiance_settings() {
    RenderSettings settings = small_settings();
    settings.hdr = true;
    return settings;
}

std::array<float, 3> pixel(const io::Pixels& image, int x, int y) {
    return {image.at(x, y, 0), image.at(x, y, 1), image.at(x, y, 2)};
}

void check_pixel(const io::Pixels& image, int x, int y, V3f expected) {
    const auto color = pixel(image, x, y);
    for (size_t channel = 0; channel < 3; ++channel) {
        CHECK(color[channel] == doctest::Approx(expected[static_cast<int>(channel)]).epsilon(0.01));
    }
}

}  // namespace

TEST_CASE("a cut-out surface is there where its texture is, for the camera and for the sun") {
    // Nothing in the square's left half; a floor below, the sun straight above.
    Scene scene;
    scene.environment.clouds = plain();
    scene.environment.sun = V3f(1);
    const auto half = std::make_shared<Texture>(4, [](float u, float) {
        return Rgba{1, 1, 1, u < 0.5f ? 0.0f : 1.0f};
    });
    Mesh card{.material = scene.add_material({.texture = half, .cutout = true})};
    Mesh floor{.material = scene.add_material({.texture = plain()})};
    card.add_quad({V3f(-1, 1, 1), {1, 1, 1}, {1, 1, -1}, {-1, 1, -1}}, V2f(0), V2f(1));
    floor.add_quad({V3f(-9, 0, 9), {9, 0, 9}, {9, 0, -9}, {-9, 0, -9}}, V2f(0), V2f(1));
    scene.add_static({card, floor});
    scene.build();
    const RenderSettings settings = radiance_settings();
    CameraPose camera;
    camera.pitch = -pi / 2;
    const auto middle_row = [&](double height) {
        camera.position = {0, height, 0};
        const RenderedFrame frame = render_frame(scene, {camera, camera}, {}, settings);
        const int y = settings.render_size.height / 2, x = settings.render_size.width / 2;
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

TEST_CASE("blended layers lie over what is behind, nearest last, and leave its depth and motion") {
    const auto build = [](const std::vector<std::pair<float, Rgba>>& layers, float opacity, bool sun) {
        auto scene = std::make_unique<Scene>();
        scene->environment = even_light();
        if (sun) scene->environment.sun = V3f(1), scene->environment.to_sun = V3f(0, 0, 1);
        scene->add_static({square(scene->add_material({.texture = plain()}), 20)});
        for (const auto& [z, color] : layers) {
            const int material = scene->add_material({.texture = plain(color), .blended = true, .opacity = opacity});
            scene->add_moving({square(material, 20)}, [z = z](double t) { return translation({t, 0, z}); });
        }
        scene->build();
        return scene;
    };
    const RenderSettings settings = radiance_settings();
    CameraPose camera = in_front(4), previous = in_front(4.1);
    const FrameState state{camera, previous, 1, 0.9};
    const auto bare = build({}, 1, false);
    const RenderedFrame behind = render_frame(*bare, state, {0.2f, 0.1f}, settings);
    check_pixel(behind.color, 20, 10, V3f(even));

    const Rgba red{1, 0, 0, 0.5f}, green{0, 1, 0, 0.5f};
    const RenderedFrame one = render_frame(*build({{1, red}}, 1, false), state, {0.2f, 0.1f}, settings);
    check_pixel(one.color, 20, 10, V3f(1, 0.5f, 0.5f) * even);
    CHECK(one.depth.values == behind.depth.values);
    CHECK(one.motion.values == behind.motion.values);

    const RenderedFrame two = render_frame(*build({{1, red}, {2, green}}, 1, false), state, {}, settings);
    check_pixel(two.color, 20, 10, V3f(0.5f, 0.75f, 0.25f) * even);
    const RenderedFrame thin = render_frame(*build({{1, red}}, 0.2f, false), state, {}, settings);
    check_pixel(thin.color, 20, 10, V3f(1, 0.9f, 0.9f) * even);

    // Four layers, not more: the fifth one, which is nearest to the wall, is left out.
    const RenderedFrame five = render_frame(
        *build({{0.2f, red}, {1, green}, {1.5f, green}, {2, green}, {2.5f, green}}, 1, false), state, {}, settings);
    check_pixel(five.color, 20, 10, V3f(1 / 16.0f, 1, 1 / 16.0f) * even);

    // The sun shines through them from behind the camera.
    const RenderedFrame lit = render_frame(*build({{1, {1, 1, 1, 0.001f}}}, 1, true), state, {}, settings);
    check_pixel(lit.color, 20, 10, V3f(even + 1));
    // And what is behind a wall is hidden.
    const RenderedFrame hidden = render_frame(*build({{-1, red}}, 1, false), state, {}, settings);
    CHECK(hidden.color.values == render_frame(*bare, state, {}, settings).color.values);
}

TEST_CASE("an overlay covers the picture at its samples' places, and has neither depth nor motion") {
    Scene scene;
    scene.environment = even_light();
    scene.add_static({square(scene.add_material({.texture = plain()}), 20)});
    scene.build();
    RenderSettings settings = radiance_settings();
    settings.reference_grid = 4;
    const FrameState state{in_front(4), in_front(4.1)};
    const RenderedFrame bare = render_frame(scene, state, {}, settings);
    // From column 12¼ of 48 on, black at half strength.
    scene.overlay = [](V2f place) { return place.x < 12.25f / 48 ? Rgba{0, 0, 0, 0} : Rgba{0, 0, 0, 0.5f}; };
    const RenderedFrame frame = render_frame(scene, state, {}, settings);
    CHECK(frame.depth.values == bare.depth.values);
    CHECK(frame.motion.values == bare.motion.values);
    check_pixel(frame.color, 11, 5, V3f(even));
    check_pixel(frame.color, 12, 5, V3f(even / 2));
    check_pixel(render_frame(scene, state, {-0.375f, 0}, settings).color, 12, 5, V3f(even));
    check_pixel(frame.reference, 23, 9, V3f(even));
    check_pixel(frame.reference, 24, 9, V3f(even * 0.75f));  // half of its samples
    check_pixel(frame.reference, 25, 9, V3f(even / 2));

    // Display-encoded: the middle grey of the display, opaque, comes out as it went in.
    scene.overlay = [](V2f) { return Rgba{0.5f, 0.25f, 1, 1}; };
    settings.hdr = false;
    check_pixel(render_frame(scene, state, {}, settings).color, 3, 3, {0.5f, 0.25f, 1});
}

TEST_CASE("corners get less of the sky's light, open places all of it") {
    const auto wall_near_the_floor = [](bool with_wall) {
        Scene scene;
        scene.environment = even_light();
        Mesh mesh{.material = scene.add_material({.texture = plain()})};
        // A floor of many vertices, so that the light can differ along it.
        for (int i = 0; i < 40; ++i) {
            const float x = -5 + 0.25f * static_cast<float>(i);
            mesh.add_quad({V3f(x, 0, 5), {x + 0.25f, 0, 5}, {x + 0.25f, 0, -5}, {x, 0, -5}}, V2f(0), V2f(1));
        }
        if (with_wall) mesh.add_quad({V3f(0, 0, 20), {0, 0, -20}, {0, 9, -20}, {0, 9, 20}}, V2f(0), V2f(1));
        scene.add_static({mesh});
        scene.build();
        CameraPose camera;
        camera.position = {-1.5, 4, 4.9};
        camera.pitch = -pi / 2;
        return render_frame(scene, {camera, camera}, {}, radiance_settings());
    };
    const RenderedFrame open = wall_near_the_floor(false), corner = wall_near_the_floor(true);
    check_pixel(open.color, 24, 16, V3f(even));
    CHECK(pixel(corner.color, 33, 16)[0] < 0.8f * even);  // near the wall
    CHECK(pixel(corner.color, 33, 16)[0] > 0.2f * even);
    CHECK(pixel(corner.color, 4, 16)[0] > pixel(corner.color, 33, 16)[0] + 0.1f * even);
    CHECK(corner.color.values == wall_near_the_floor(true).color.values);
}

TEST_CASE("several samples a pixel average what the pixel covers; depth and motion stay at its place") {
    const auto scene = smooth_scene();
    RenderSettings settings = radiance_settings();
    settings.mip_bias = 0;
    settings.output_size = settings.render_size;
    settings.reference_grid = 8;
    const FrameState state{in_front(5), in_front(5.1), 1, 0.9};
    const RenderedFrame one = render_frame(*scene, state, {0.25f, -0.25f}, settings);
    const RenderedFrame still = render_frame(*scene, state, {}, settings);
    settings.samples = 32;
    settings.mip_bias = -2.5f;  // each sample's texels are then as small as its share of the pixel
    const RenderedFrame many = render_frame(*scene, state, {}, settings);
    const RenderedFrame moved = render_frame(*scene, state, {0.25f, -0.25f}, settings);
    CHECK(psnr(many.color, still.reference) > 45);
    CHECK(psnr(many.color, still.reference) > psnr(still.color, still.reference) + 6);
    CHECK(many.depth.values == still.depth.values);
    CHECK(moved.depth.values == one.depth.values);
    CHECK(moved.motion.values == one.motion.values);
    CHECK(moved.color.values != many.color.values);
}
