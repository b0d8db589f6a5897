#include "render/worlds/action_paint.h"

#include <OpenImageIO/imagebufalgo.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>

#include "render/worlds/invented_textures.h"
#include "render/worlds/lettering.h"
#include "render/worlds/noise.h"

namespace clarus::render {
namespace {

using Imath::V2f;
using Imath::V3f;

constexpr float pi = std::numbers::pi_v<float>;

float between(Random& random, double low, double high) { return static_cast<float>(random.uniform(low, high)); }

/// What the patterns have in common.
struct Grain {
    ColorPair colors;
    int cells = 8, salt = 0;
    bool shifted = false;
    float share = 0.5f;  // of the figure

    V3f mixed(float figure) const { return mix(colors.ground, colors.figure, std::clamp(figure, 0.0f, 1.0f)); }
};

V3f bricks(float u, float v, const Grain& g) {
    const Brick brick = brick_at(u, v, std::max(2, g.cells / 2), 2 * (g.cells / 2), g.shifted);
    const float tone = 0.65f + 0.35f * cell_value(brick.column, brick.row, g.salt);
    return mix(g.colors.ground, g.colors.figure * tone, step_between(0.06f, 0.1f, brick.edge));
}

V3f checks(float u, float v, const Grain& g) {
    const Brick place = brick_at(u, v, g.cells, g.cells, false);
    return g.mixed(static_cast<float>((place.column + place.row) % 2));
}

V3f stripes(float u, float v, const Grain& g) {
    const float along = g.shifted ? u + v : u, x = fraction(along * static_cast<float>(g.cells));
    return g.mixed(x < g.share ? 1 : 0);
}

V3f dots(float u, float v, const Grain& g) {
    const Brick place = brick_at(u, v, g.cells, 2 * (g.cells / 2), g.shifted);
    const float distance = V2f(place.x - 0.5f, place.y - 0.5f).length();
    return g.mixed(1 - step_between(0.6f * g.share, 0.6f * g.share + 0.03f, distance));
}

/// Squares of many hues.
V3f blocks(float u, float v, const Grain& g) {
    const Brick place = brick_at(u, v, g.cells, g.cells, false);
    if (place.edge < 0.04f) return g.colors.ground;
    const float hue = cell_value(place.column, place.row, g.salt), value = cell_value(place.row, place.column, g.salt);
    return hue_color(hue, 0.95f, value < 0.3f ? 0.05f : 0.3f + 0.6f * value);
}

V3f rings(float u, float v, const Grain& g) {
    const Brick place = brick_at(u, v, std::max(1, g.cells / 4), std::max(1, g.cells / 4), false);
    const float distance = V2f(place.x - 0.5f, place.y - 0.5f).length();
    return g.mixed(fraction(5 * distance) < g.share ? 1 : 0);
}

V3f zigzag(float u, float v, const Grain& g) {
    const float cells = static_cast<float>(g.cells), wave = std::abs(fraction(u * cells) - 0.5f);
    return g.mixed(fraction(v * cells + wave) < g.share ? 1 : 0);
}

/// Overlapping round scales, as roofs and fish have.
V3f scales(float u, float v, const Grain& g) {
    const Brick place = brick_at(u, v, g.cells, 2 * (g.cells / 2), true);
    const float distance = V2f(place.x - 0.5f, 0.7f * place.y).length();
    return g.mixed(step_between(0.3f, 0.34f, distance) - step_between(0.46f, 0.5f, distance));
}

/// A page of numbers in rows, as on a timetable.
std::shared_ptr<const Texture> table(Random& random, const ColorPair& colors) {
    constexpr int log2_side = 9, side = 1 << log2_side;
    OIIO::ImageBuf image(OIIO::ImageSpec(side, side, 4, OIIO::TypeDesc::FLOAT));
    const std::array<float, 4> paper = {colors.ground.x, colors.ground.y, colors.ground.z, 1};
    const std::array<float, 4> ink = {colors.figure.x, colors.figure.y, colors.figure.z, 1};
    OIIO::ImageBufAlgo::fill(image, paper);
    for (int y = 0; y < side;) {
        const int size = 12 + random.below(5) * random.below(5) * 4;
        y += size + size / 3;
        if (y > side - 4) break;
        std::string row;
        for (int column = 0; column < 8; ++column) row += std::to_string(100 + random.below(900)) + "  ";
        write_text(image, 8, y - 2, size, row.substr(0, static_cast<size_t>(750 / size)), ink);
        OIIO::ImageBufAlgo::fill(image, ink, OIIO::ROI(0, side, y + size / 8, y + size / 8 + 1 + size / 24));
    }
    std::vector<Rgba> texels(static_cast<size_t>(side) * side);
    image.get_pixels(OIIO::ROI::All(), OIIO::TypeDesc::FLOAT, texels.data());
    return std::make_shared<Texture>(log2_side, log2_side, std::move(texels));
}

}  // namespace

V3f hue_color(float hue, float saturation, float value) {
    const auto channel = [&](float shift) {
        const float ramp = std::clamp(std::abs(6 * fraction(hue + shift) - 3) - 1, 0.0f, 1.0f);
        return value * (1 - saturation + saturation * ramp);
    };
    return {channel(0), channel(2.0f / 3), channel(1.0f / 3)};
}

ColorPair contrasting_colors(Random& random) {
    const float hue = between(random, 0, 1), other = hue + between(random, 0.25, 0.75);
    const V3f dark = hue_color(hue, between(random, 0.2, 0.9), between(random, 0.01, 0.06));
    const V3f pale = hue_color(hue, between(random, 0, 0.25), between(random, 0.75, 0.92));
    const V3f strong = hue_color(other, between(random, 0.92, 1), between(random, 0.5, 0.9));
    switch (random.below(6)) {
        case 0:
            return {pale, dark};
        case 1:
            return {dark, pale};
        case 2:
            return {strong, dark};
        case 3:
            return {dark, strong};
        case 4:
            return {pale, strong};
        default:
            return {strong, hue_color(hue, 0.98f, between(random, 0.5, 0.9))};
    }
}

std::shared_ptr<const Texture> action_texture(Random& random, ActionPattern pattern, const ColorPair& colors) {
    using Formula = V3f (*)(float u, float v, const Grain& grain);
    Formula formula = bricks;
    switch (pattern) {
        case ActionPattern::print:
            return invented_sign(random, colors.ground, colors.figure);
        case ActionPattern::table:
            return table(random, colors);
        case ActionPattern::bricks:
            break;
        case ActionPattern::checks:
            formula = checks;
            break;
        case ActionPattern::stripes:
            formula = stripes;
            break;
        case ActionPattern::dots:
            formula = dots;
            break;
        case ActionPattern::blocks:
            formula = blocks;
            break;
        case ActionPattern::rings:
            formula = rings;
            break;
        case ActionPattern::zigzag:
            formula = zigzag;
            break;
        case ActionPattern::scales:
            formula = scales;
            break;
    }
    Grain grain{.colors = colors};
    grain.cells = std::array{4, 6, 8, 12, 16}[static_cast<size_t>(random.below(5))];
    grain.salt = random.below(1 << 20);
    grain.shifted = random.below(2) == 0;
    grain.share = between(random, 0.3, 0.6);
    return std::make_shared<Texture>(8, [=](float u, float v) {
        return opaque(formula(u, v, grain) * (0.9f + 0.2f * noise(u, v, 64, 64, grain.salt)));
    });
}

V3f ActionPaint::strong_color() {
    const float hue = between(random_, 0, 1), saturation = between(random_, 0.88, 1);
    return hue_color(hue, saturation, random_.below(4) ? between(random_, 0.5, 0.92) : between(random_, 0.02, 0.08));
}

int ActionPaint::plain(const V3f& color) {
    return scene_.add_material({.texture = std::make_shared<Texture>(0, [=](float, float) { return opaque(color); }),
                                .highlight = between(random_, 0, 0.5)});
}

int ActionPaint::patterned(bool own_light) {
    const ActionPattern pattern = patterns_[static_cast<size_t>(random_.below(static_cast<int>(patterns_.size())))];
    const ColorPair colors = contrasting_colors(random_);
    Material material{.texture = action_texture(random_, pattern, colors)};
    material.highlight = random_.below(3) ? 0 : between(random_, 0.1, 0.6);
    if (own_light && random_.below(3)) material.emission = own_light_ * between(random_, 0.5, 1);
    return scene_.add_material(std::move(material));
}

int ActionPaint::wall() { return random_.below(3) ? patterned() : plain(); }

int ActionPaint::glow() {
    const bool white = random_.below(4) == 0, soft = random_.below(2) == 0;
    const V3f color = white ? V3f(1, between(random_, 0.75, 0.95), between(random_, 0.4, 0.9))
                            : hue_color(between(random_, 0, 1), between(random_, 0.95, 1), 1);
    const float radiance = soft ? between(random_, 1.5, 6) : std::exp(between(random_, 3.7, 6.9));
    return scene_.add_material(
        {.texture = std::make_shared<Texture>(0, [=](float, float) { return opaque(color); }), .emission = radiance});
}

int ActionPaint::leaves() {
    const V3f color = random_.below(3) ? hue_color(between(random_, 0.2, 0.4), 0.85f, between(random_, 0.15, 0.6))
                                       : hue_color(between(random_, 0, 1), 0.9f, between(random_, 0.3, 0.8));
    return holed(invented_leaves(random_, color));
}

int ActionPaint::wire_net(bool slanted) {
    const V3f color = random_.below(3) ? V3f(between(random_, 0, 1) < 0.5f ? 0.03f : 0.75f) : strong_color();
    const float cells = static_cast<float>(4 + random_.below(5)), width = between(random_, 0.04, 0.1);
    return holed(std::make_shared<Texture>(8, [=](float u, float v) {
        const float a = fraction(cells * (slanted ? u + v : u)), b = fraction(cells * (slanted ? u - v : v));
        const bool wire = std::min(std::min(a, 1 - a), std::min(b, 1 - b)) < width;
        return Rgba{color.x, color.y, color.z, wire ? 1.0f : 0.0f};
    }));
}

int ActionPaint::holed(std::shared_ptr<const Texture> texture) {
    return scene_.add_material({.texture = std::move(texture), .cutout = true});
}

}  // namespace clarus::render
