#include "render/worlds/invented_textures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "render/worlds/noise.h"

namespace clarus::render {
namespace {

using Imath::V2f;
using Imath::V3f;

constexpr float pi = std::numbers::pi_v<float>;

V3f from_hue(float hue, float saturation) {
    const auto channel = [&](float shift) { return 0.5f + 0.5f * std::cos(2 * pi * (hue + shift)); };
    const V3f pure(channel(0), channel(1.0f / 3), channel(2.0f / 3));
    const V3f color = mix(V3f(0.5f), pure, saturation);
    return color * (3 / (color.x + color.y + color.z));
}

/// What a pattern says of a place: which of two colours, how light, in [0, 1].
struct Tone {
    float blend, light;
};

/// Parameters that patterns share.
struct Grain {
    int cells, salt;
    float edge;  // width of joints
    bool shifted;
};

using Pattern = Tone (*)(float u, float v, const Grain& grain);

Tone stones(float u, float v, const Grain& grain) {
    const Brick brick = brick_at(u, v, grain.cells / 2, grain.cells, grain.shifted);
    const float value = cell_value(brick.column, brick.row, grain.salt);
    return {value, step_between(grain.edge / 2, grain.edge, brick.edge) * (0.75f + 0.25f * value)};
}

Tone boards(float u, float v, const Grain& grain) {
    const Brick board = brick_at(u, v, 1, std::max(2, grain.cells / 2), grain.shifted);
    const float lines = noise(u, v, 6, 16 * grain.cells, grain.salt + board.row % 7);
    return {lines,
            step_between(0, grain.edge, board.edge) * (0.7f + 0.3f * cell_value(board.column, board.row, grain.salt))};
}

Tone pebbles(float u, float v, const Grain& grain) {
    const Cell cell = cell_at(u, v, grain.cells, grain.salt);
    return {cell.value, step_between(grain.edge / 2, grain.edge + 0.1f, cell.second - cell.nearest)};
}

Tone dots(float u, float v, const Grain& grain) {
    const Brick place = brick_at(u, v, grain.cells, grain.cells, grain.shifted);
    const float distance = V2f(place.x - 0.5f, place.y - 0.5f).length();
    return {step_between(0.3f, 0.34f, distance), 1};
}

Tone stripes(float u, float v, const Grain& grain) {
    const float along = grain.shifted ? u + v : v, x = fraction(along * static_cast<float>(grain.cells));
    return {step_between(0.45f, 0.5f, x) - step_between(0.94f, 0.99f, x), 1};
}

Tone weave(float u, float v, const Grain& grain) {
    const float x = u * static_cast<float>(grain.cells), y = v * static_cast<float>(grain.cells);
    const bool over = (static_cast<int>(std::floor(x)) + static_cast<int>(std::floor(y))) % 2 == 0;
    const float across = over ? fraction(y) : fraction(x);
    return {over ? 0.0f : 1.0f, 0.45f + 0.55f * std::sin(pi * across)};
}

Tone checks(float u, float v, const Grain& grain) {
    const Brick place = brick_at(u, v, grain.cells, grain.cells, false);
    const int sum = (grain.shifted ? 2 : 1) * place.column + place.row;
    return {sum % 2 ? 1.0f : 0.0f, step_between(0, grain.edge / 2, place.edge)};
}

Tone dirt(float u, float v, const Grain& grain) {
    return {step_between(0.35f, 0.65f, fractal(u, v, std::max(2, grain.cells / 4), 6, grain.salt)),
            0.6f + 0.4f * cell_value(static_cast<int>(u * 512), static_cast<int>(v * 512), grain.salt + 9)};
}

Tone veins(float u, float v, const Grain& grain) {
    const float bent = fractal(u, v, std::max(2, grain.cells / 4), 5, grain.salt);
    const float wave = std::abs(std::sin(pi * (static_cast<float>(grain.cells / 2) * u + 5 * bent)));
    return {step_between(0, 0.35f, wave), 0.8f + 0.2f * bent};
}

Tone ribs(float u, float v, const Grain& grain) {
    const Brick sheet = brick_at(u, v, 2, 3, true);
    return {cell_value(sheet.column, sheet.row, grain.salt),
            (0.55f + 0.45f * std::sin(2 * pi * u * static_cast<float>(grain.cells))) *
                step_between(0, grain.edge / 4, sheet.edge)};
}

constexpr std::array<Pattern, 10> patterns = {stones, boards, pebbles, dots, stripes, weave, checks, dirt, veins, ribs};

float between(Random& random, double low, double high) { return static_cast<float>(random.uniform(low, high)); }

}  // namespace

ColorScheme::ColorScheme(Random& random) {
    const float hue = between(random, 0, 1), spread = between(random, 0.03, 0.5),
                saturation = between(random, 0.08, 0.6);
    for (int i = 0; i < 5; ++i) {
        const float turn = hue + spread * static_cast<float>(i % 3 - 1) + (i == 4 ? 0.5f : 0.0f);
        hues_.push_back(from_hue(turn, saturation * between(random, 0.4, 1)));
    }
    hues_.push_back(V3f(1));  // greys go with everything
}

V3f ColorScheme::pick(Random& random, float brightness) const {
    const V3f color = hues_[static_cast<size_t>(random.below(static_cast<int>(hues_.size())))] * brightness;
    return {std::min(color.x, 0.92f), std::min(color.y, 0.92f), std::min(color.z, 0.92f)};
}

std::shared_ptr<const Texture> invented_surface(Random& random, const ColorScheme& colors, float brightness) {
    const Pattern pattern = patterns[static_cast<size_t>(random.below(static_cast<int>(patterns.size())))];
    const Grain grain{4 << random.below(4), random.below(1 << 20), between(random, 0.03, 0.12), random.below(2) == 0};
    const V3f first = colors.pick(random, brightness * between(random, 0.6, 1.4));
    const V3f second = mix(first, colors.pick(random, brightness * between(random, 0.3, 1.6)), between(random, 0.2, 1));
    const float joint = between(random, 0.1, 0.7), roughness = between(random, 0.05, 0.5);
    const float stain = random.below(3) == 0 ? between(random, 0.2, 0.7) : 0;
    const V3f stain_color = colors.pick(random, 0.3f * brightness);
    return std::make_shared<Texture>(8 + random.below(4) / 3, [=](float u, float v) {
        const Tone tone = pattern(u, v, grain);
        V3f color = mix(first, second, tone.blend) * std::lerp(joint, 1.0f, tone.light);
        color *= 1 + roughness * (2 * fractal(u, v, 32, 3, grain.salt + 31) - 1);
        if (stain > 0) {
            color = mix(color, stain_color, stain * step_between(0.5f, 0.7f, fractal(u, v, 4, 5, grain.salt + 41)));
        }
        return opaque(color);
    });
}

std::shared_ptr<const Texture> invented_leaves(Random& random, const V3f& color) {
    const int count = 12 + random.below(60), salt = random.below(1 << 20);
    const float length = between(random, 0.5, 0.9) / std::sqrt(static_cast<float>(count)),
                slim = between(random, 0.15, 0.6);
    const V3f dark = color * between(random, 0.3, 0.7);
    return std::make_shared<Texture>(8, [=](float u, float v) {
        Rgba texel{0.7f * color.x, 0.7f * color.y, 0.7f * color.z, 0};
        for (int leaf = 0; leaf < count; ++leaf) {
            const auto value = [&](int which) { return cell_value(leaf, which, salt); };
            const V2f offset(u - 0.14f - 0.72f * value(0), v - 0.14f - 0.72f * value(1));
            const float angle = 2 * pi * value(2), size = length * (0.7f + 0.6f * value(3));
            const float along = (offset.x * std::cos(angle) + offset.y * std::sin(angle)) / size;
            const float across = (offset.y * std::cos(angle) - offset.x * std::sin(angle)) / size;
            if (std::abs(along) > 1 || std::abs(across) > slim * (1 - along * along)) continue;
            texel = opaque(mix(dark, color, value(4)) * (std::abs(across) < 0.05f ? 1.4f : 1.0f));
        }
        return texel;
    });
}

std::shared_ptr<const Texture> invented_mesh(Random& random, const V3f& color) {
    const float cells = static_cast<float>(4 << random.below(2)), width = between(random, 0.06, 0.14);
    const bool slanted = random.below(2) == 0;
    return std::make_shared<Texture>(8, [=](float u, float v) {
        const float a = fraction(cells * (slanted ? u + v : u)), b = fraction(cells * (slanted ? u - v : v));
        const bool wire = std::min(std::min(a, 1 - a), std::min(b, 1 - b)) < width;
        return Rgba{color.x, color.y, color.z, wire ? 1.0f : 0.0f};
    });
}

std::shared_ptr<const Texture> invented_puff(Random& random, const V3f& color) {
    const int salt = random.below(1 << 20);
    const float ragged = between(random, 0, 0.9);
    return std::make_shared<Texture>(6, [=](float u, float v) {
        const float fade = std::max(0.0f, 1 - 2 * V2f(u - 0.5f, v - 0.5f).length());
        const float alpha = smooth(fade) * (1 - ragged + 2 * ragged * fractal(u, v, 4, 4, salt));
        return Rgba{color.x, color.y, color.z, std::clamp(alpha, 0.0f, 1.0f)};
    });
}

}  // namespace clarus::render
