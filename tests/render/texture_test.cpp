#include <doctest/doctest.h>

#include <cmath>

#include "clarus/error.h"
#include "io/image.h"
#include "render_harness.h"
#include "temporary_folder.h"

using namespace clarus;
using namespace clarus::render;
using namespace clarus::render_test;
using Imath::V2f;
using Imath::V4f;

namespace {

constexpr float rounding = 0.008f;  // 8 bits of a square root

void check_color(const V4f& sample, const V4f& expected) {
    for (int channel = 0; channel < 4; ++channel) CHECK(std::abs(sample[channel] - expected[channel]) < rounding);
}

float linear(int byte) {
    const float y = static_cast<float>(byte) / 255;
    return y <= 0.04045f ? y / 12.92f : std::pow((y + 0.055f) / 1.055f, 2.4f);
}

}  // namespace

TEST_CASE("a texture's levels are means of its texels, and it repeats") {
    const Texture texture(2, [](float u, float v) {
        return Rgba{u < 0.5f ? 0.81f : 0.25f, v < 0.5f ? 1.0f : 0.0f, 0.5f, 1};
    });
    CHECK(texture.opaque());
    check_color(texture.sample({0.125f, 0.875f}, 0), {0.81f, 0, 0.5f, 1});
    check_color(texture.sample({1.125f, -0.125f}, -3), {0.81f, 0, 0.5f, 1});
    check_color(texture.sample({0.5f, 0.625f}, 0), {0.53f, 0, 0.5f, 1});   // between two texels
    check_color(texture.sample({0.3f, 0.9f}, 2), {0.53f, 0.5f, 0.5f, 1});  // one texel is left
    check_color(texture.sample({0.3f, 0.9f}, 9), {0.53f, 0.5f, 0.5f, 1});
    check_color(texture.sample({0.25f, 0.25f}, 1.5f), {0.67f, 0.75f, 0.5f, 1});  // half a 2 by 2 level, half the last
}

TEST_CASE("holes of a texture lend their surroundings no colour") {
    // Red where there is something; the holes are white.
    const Texture texture(2, [](float u, float) { return u < 0.25f ? Rgba{1, 0, 0, 1} : Rgba{1, 1, 1, 0}; });
    CHECK(!texture.opaque());
    check_color(texture.sample({0.1f, 0.1f}, 2), {1, 0, 0, 0.25f});
    check_color(texture.sample({0.25f, 0.1f}, 0), {1, 0, 0, 0.5f});  // on the edge
    CHECK(texture.alpha({0.125f, 0.4f}) == doctest::Approx(1));
    CHECK(texture.alpha({0.25f, 0.4f}) == doctest::Approx(0.5));
    CHECK(texture.alpha({0.6f, 0.4f}) == doctest::Approx(0));
}

TEST_CASE("textures from files: any size, grey or coloured, with alpha") {
    const TemporaryFolder folder;
    const auto load = [&](Size size, int channels, const std::vector<int>& bytes) {
        io::Pixels pixels{size, channels, {}};
        for (const int byte : bytes) pixels.values.push_back(static_cast<float>(byte) / 255);
        io::write_image(folder / "texture.png", pixels, io::SampleType::u8);
        return Texture::load(folder / "texture.png");
    };
    SUBCASE("twice as wide as high") {
        const auto texture = load({2, 1}, 3, {200, 100, 50, 20, 30, 40});
        CHECK(texture->size() == V2f(2, 1));
        CHECK(texture->opaque());
        check_color(texture->sample({0.25f, 0.5f}, 0), {linear(200), linear(100), linear(50), 1});
        check_color(texture->sample({0.75f, 0.1f}, 0), {linear(20), linear(30), linear(40), 1});
        check_color(texture->sample({0.75f, 0.1f}, 1),
                    {(linear(200) + linear(20)) / 2, (linear(100) + linear(30)) / 2, (linear(50) + linear(40)) / 2, 1});
    }
    SUBCASE("v runs down") {
        const auto texture = load({1, 2}, 1, {255, 0});
        check_color(texture->sample({0.5f, 0.25f}, 0), {1, 1, 1, 1});
        check_color(texture->sample({0.5f, 0.75f}, 0), {0, 0, 0, 1});
    }
    SUBCASE("grey and colour with alpha") {
        check_color(load({1, 1}, 2, {100, 51})->sample(V2f(0), 0), {linear(100), linear(100), linear(100), 0.2f});
        check_color(load({1, 1}, 4, {100, 90, 80, 51})->sample(V2f(0), 0), {linear(100), linear(90), linear(80), 0.2f});
    }
    SUBCASE("sizes that are no powers of two") {
        const auto texture = load({3, 5}, 3, std::vector<int>(45, 120));
        CHECK(texture->size() == V2f(4, 8));
        check_color(texture->sample({0.4f, 0.3f}, 0), {linear(120), linear(120), linear(120), 1});
    }
    CHECK_THROWS_WITH_AS(Texture::load(folder / "none.png"), doctest::Contains("none.png"), Error);
}

TEST_CASE("textures are filtered over what a sample covers") {
    // Stripes less than a third of a pixel wide on a square that faces the camera, then the same lying flat.
    const auto stripes = std::make_shared<Texture>(1, [](float u, float) {
        return u < 0.5f ? Rgba{0.9f, 0.9f, 0.9f, 1} : Rgba{0.1f, 0.1f, 0.1f, 1};
    });
    const CameraPose camera = in_front(2);
    RenderSettings settings = small_settings();
    settings.hdr = true;
    settings.mip_bias = 0;
    const float pixel = static_cast<float>(2 / focal(camera, settings.render_size));  // at that distance
    const auto worst_in_the_middle = [&](Imath::V3d turn, float bias) {
        Scene scene;
        scene.environment = even_light();
        Mesh mesh = square(scene.add_material({.texture = stripes}), 8);
        for (V2f& uv : mesh.uvs) uv *= 16 / (pixel / 1.7f);
        Mesh placed{.material = mesh.material};
        placed.append(mesh, Imath::M44f(rotation(turn)));
        scene.add_static({placed});
        scene.build();
        settings.mip_bias = bias;
        const RenderedFrame frame = render_frame(scene, {camera, camera}, {0.1f, 0.1f}, settings);
        float worst = 0;
        for (int x = 14; x < 34; ++x) worst = std::max(worst, std::abs(frame.color.at(x, 16, 0) / 0.55f - 0.5f));
        return worst;
    };
    CHECK(worst_in_the_middle({0, 0, 0}, 0) < 0.02f);
    CHECK(worst_in_the_middle({1.2, 0, 0}, 0) < 0.02f);
    CHECK(worst_in_the_middle({0.5, 0.9, 0.4}, 0) < 0.02f);
    CHECK(worst_in_the_middle({0, 0, 0}, -4) > 0.1f);
}
