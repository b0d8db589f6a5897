#include "render/worlds/procedural.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "base/error.h"
#include "render/worlds/noise.h"

namespace clarus::render {
namespace {

using Imath::V2f;
using Imath::V3f;

constexpr float pi = std::numbers::pi_v<float>;

Rgba tiles(float u, float v) {
    const Brick tile = brick_at(u, v, 4, 4, false);
    const bool dark = (tile.column + tile.row) % 2;
    const float tone = 0.8f + 0.35f * cell_value(tile.column, tile.row, 1);
    const float grain = 0.82f + 0.36f * fractal(u, v, 32, 4, 2);
    V3f color = (dark ? V3f(0.25f, 0.15f, 0.11f) : V3f(0.50f, 0.43f, 0.34f)) * (tone * grain);
    // A ring set into every other tile.
    const float ring = std::abs(V2f(tile.x - 0.5f, tile.y - 0.5f).length() - 0.27f);
    if (!dark) color = mix(V3f(0.07f, 0.12f, 0.22f), color, step_between(0.02f, 0.035f, ring));
    return opaque(mix(V3f(0.07f, 0.065f, 0.06f), color, step_between(0.012f, 0.03f, tile.edge)));
}

Rgba cobbles(float u, float v) {
    constexpr int cells = 12;
    const float x = u * cells, y = v * cells;
    const int left = static_cast<int>(x), top = static_cast<int>(y);
    float nearest = std::numeric_limits<float>::max(), second = nearest, tone = 0;
    for (int dy = -1; dy <= 1; ++dy) {
        for (int dx = -1; dx <= 1; ++dx) {
            const int cx = wrap(left + dx, cells), cy = wrap(top + dy, cells);
            const V2f stone(static_cast<float>(left + dx) + 0.2f + 0.6f * cell_value(cx, cy, 3),
                            static_cast<float>(top + dy) + 0.2f + 0.6f * cell_value(cx, cy, 4));
            const float distance = (stone - V2f(x, y)).length();
            if (distance < nearest) {
                second = nearest;
                nearest = distance;
                tone = cell_value(cx, cy, 5);
            } else {
                second = std::min(second, distance);
            }
        }
    }
    const V3f stone = mix(V3f(0.20f, 0.19f, 0.19f), V3f(0.45f, 0.40f, 0.35f), tone) * (1.15f - 0.5f * nearest) *
                      (0.8f + 0.4f * fractal(u, v, 64, 3, 6));
    return opaque(mix(V3f(0.05f, 0.05f, 0.04f), stone, step_between(0.04f, 0.16f, second - nearest)));
}

Rgba asphalt(float u, float v) {
    const float speckle = cell_value(static_cast<int>(u * 256), static_cast<int>(v * 256), 7);
    const float tone = 0.05f + 0.05f * fractal(u, v, 4, 5, 8) + (speckle > 0.93f ? 0.18f : 0.05f * speckle);
    return opaque(V3f(tone, tone, tone * 1.05f));
}

Rgba grass(float u, float v) {
    const float patches = fractal(u, v, 4, 4, 9), streaks = noise(u, v, 160, 48, 10);
    const float fine = cell_value(static_cast<int>(u * 256), static_cast<int>(v * 256), 11);
    V3f color = mix(V3f(0.05f, 0.13f, 0.025f), V3f(0.20f, 0.27f, 0.06f), patches) * (0.55f + 0.9f * streaks * fine);
    if (fine > 0.985f && patches > 0.5f) color = V3f(0.75f, 0.68f, 0.30f);  // flowers
    return opaque(color);
}

Rgba brick(float u, float v) {
    const Brick b = brick_at(u, v, 6, 16, true);
    const float tone = cell_value(b.column, b.row, 12);
    const V3f clay =
        mix(V3f(0.42f, 0.13f, 0.08f), V3f(0.62f, 0.30f, 0.17f), tone) * (0.7f + 0.6f * fractal(u, v, 48, 3, 13));
    return opaque(mix(V3f(0.52f, 0.49f, 0.44f), clay, step_between(0.07f, 0.13f, b.edge)));
}

Rgba plaster(float u, float v) {
    const float stain = fractal(u, v, 3, 5, 14), fine = fractal(u, v, 96, 2, 15);
    return opaque(mix(V3f(0.78f, 0.74f, 0.64f), V3f(0.50f, 0.45f, 0.38f), step_between(0.45f, 0.75f, stain)) *
                  (0.86f + 0.28f * fine));
}

Rgba planks(float u, float v) {
    const Brick plank = brick_at(u, v, 1, 8, true);
    const float salt = cell_value(plank.column, plank.row, 16);
    const float grain = noise(u, v, 8, 160, 17 + static_cast<int>(8 * salt)), waves = fractal(u, v, 6, 3, 30);
    const V3f wood =
        mix(V3f(0.30f, 0.16f, 0.07f), V3f(0.60f, 0.38f, 0.19f), 0.5f * fraction(grain + 2 * waves) + 0.5f * salt);
    return opaque(wood * step_between(0.01f, 0.05f, plank.edge));
}

Rgba shingles(float u, float v) {
    const Brick b = brick_at(u, v, 10, 12, true);
    const float tone = cell_value(b.column, b.row, 31);
    const float rounded = b.y - 0.25f * std::abs(2 * b.x - 1);
    const V3f slate = mix(V3f(0.16f, 0.09f, 0.08f), V3f(0.46f, 0.20f, 0.13f), tone) * (0.5f + 0.6f * b.y);
    return opaque(slate * step_between(-0.1f, 0.1f, rounded) * (0.8f + 0.4f * noise(u, v, 128, 128, 32)));
}

Rgba plates(float u, float v) {
    const float ribs = 0.55f + 0.45f * std::sin(u * 2 * pi * 24);
    const float rust = step_between(0.55f, 0.7f, fractal(u, v, 4, 5, 33));
    const Brick sheet = brick_at(u, v, 2, 2, false);
    const V3f metal = V3f(0.50f, 0.53f, 0.56f) * (0.55f + 0.45f * ribs) * (sheet.edge < 0.012f ? 0.25f : 1.0f);
    return opaque(mix(metal, V3f(0.32f, 0.14f, 0.06f) * (0.6f + 0.4f * ribs), rust));
}

Rgba checker(float u, float v) {
    const Brick square = brick_at(u, v, 8, 8, false);
    const bool dark = (square.column + square.row) % 2;
    return opaque((dark ? V3f(0.03f) : V3f(0.82f)) * (0.9f + 0.2f * fractal(u, v, 16, 3, 34)));
}

/// Lines of writing in an alphabet of its own: glyphs of 3 by 5 cells.
Rgba sign(float u, float v) {
    constexpr int columns = 14, rows = 8;
    const Brick glyph = brick_at(u, v, columns, rows, false);
    const float border = std::min(std::min(u, 1 - u), std::min(v, 1 - v));
    if (border < 0.025f) return opaque(V3f(0.02f, 0.05f, 0.22f));
    const int x = static_cast<int>(glyph.x * 5) - 1, y = static_cast<int>(glyph.y * 8) - 1;
    const bool letter = cell_value(glyph.column, glyph.row, 35) > 0.18f && glyph.column > 0 &&
                        glyph.column < columns - 1 && glyph.row > 0 && glyph.row < rows - 1;
    const bool inked =
        letter && x >= 0 && x < 3 && y >= 0 && y < 5 && cell_value(glyph.column * 8 + x, glyph.row * 8 + y, 36) > 0.42f;
    const V3f ink = glyph.row == 5 ? V3f(0.55f, 0.04f, 0.03f) : V3f(0.02f, 0.03f, 0.08f);
    return opaque(inked ? ink : V3f(0.86f, 0.85f, 0.78f));
}

Rgba facade(float u, float v) {
    const Brick window = brick_at(u, v, 4, 4, false);
    const float x = std::abs(window.x - 0.5f), y = std::abs(window.y - 0.48f);
    if (x < 0.27f && y < 0.33f) {
        if (std::min(std::abs(x - 0.135f), x) < 0.012f || std::abs(y - 0.11f) < 0.012f || x > 0.25f || y > 0.31f) {
            return opaque(V3f(0.80f, 0.78f, 0.72f));
        }
        const float curtain = cell_value(window.column, window.row, 37);
        const float blind = window.y < 0.2f + 0.5f * curtain ? 0.6f + 0.4f * std::sin(window.y * 2 * pi * 26) : 0.0f;
        return opaque(mix(V3f(0.03f, 0.045f, 0.06f), V3f(0.60f, 0.52f, 0.36f), 0.6f * blind));
    }
    if (y < 0.37f && x < 0.31f) return opaque(V3f(0.62f, 0.60f, 0.55f));  // the frame of stone
    const Brick course = brick_at(u, v, 16, 48, true);
    const float tone = 0.8f + 0.3f * cell_value(course.column, course.row, 38);
    return opaque(V3f(0.58f, 0.50f, 0.42f) * tone * (0.6f + 0.4f * step_between(0.05f, 0.15f, course.edge)));
}

Rgba clouds(float u, float v) {
    const float cover = step_between(0.46f, 0.72f, fractal(u, v, 5, 6, 39));
    return opaque(V3f(cover));
}

Rgba stripes(float u, float v) {
    return opaque(fraction(4 * (u + v)) < 0.5f ? V3f(0.80f, 0.55f, 0.04f) : V3f(0.03f, 0.03f, 0.03f));
}

Rgba concrete(float u, float v) {
    const Brick slab = brick_at(u, v, 2, 2, false);
    const float tone = 0.36f + 0.16f * fractal(u, v, 8, 5, 40) + 0.06f * cell_value(slab.column, slab.row, 41);
    return opaque(V3f(tone, tone * 0.98f, tone * 0.93f) * (slab.edge < 0.012f ? 0.4f : 1.0f));
}

Rgba bark(float u, float v) {
    const float ridge = noise(u, v, 24, 6, 42) * noise(u, v, 48, 12, 43);
    return opaque(mix(V3f(0.06f, 0.04f, 0.025f), V3f(0.34f, 0.24f, 0.15f), ridge * 1.4f));
}

/// A twig: about forty pointed leaves. The holes are green too, so that coarse mip levels do not darken.
Rgba leaves(float u, float v) {
    Rgba texel = {0.10f, 0.19f, 0.03f, 0};
    for (int leaf = 0; leaf < 44; ++leaf) {
        const auto value = [&](int salt) { return cell_value(leaf, salt, 44); };
        const V2f center(0.14f + 0.72f * value(0), 0.14f + 0.72f * value(1));
        const float angle = 2 * pi * value(2), length = 0.07f + 0.06f * value(3);
        const V2f offset = V2f(u, v) - center;
        const float along = (offset.x * std::cos(angle) + offset.y * std::sin(angle)) / length;
        const float across = (offset.y * std::cos(angle) - offset.x * std::sin(angle)) / length;
        if (std::abs(along) > 1 || std::abs(across) > 0.42f * (1 - along * along)) continue;
        const float vein = std::abs(across) < 0.04f ? 1.5f : 1.0f;
        const V3f color = mix(V3f(0.05f, 0.14f, 0.02f), V3f(0.24f, 0.32f, 0.06f), value(4)) * vein;
        texel = opaque(color);
    }
    return texel;
}

Rgba lattice(float u, float v) {
    const float a = fraction(8 * (u + v)), b = fraction(8 * (u - v));
    const bool wire = std::min(std::min(a, 1 - a), std::min(b, 1 - b)) < 0.09f;
    return {0.42f, 0.44f, 0.45f, wire ? 1.0f : 0.0f};
}

/// Blades of grass, rooted at v = 0.
Rgba blades(float u, float v) {
    Rgba texel = {0.12f, 0.22f, 0.04f, 0};
    for (int blade = 0; blade < 26; ++blade) {
        const auto value = [&](int salt) { return cell_value(blade, salt, 45); };
        const float height = 0.45f + 0.5f * value(0), lean = 0.5f * (value(1) - 0.5f);
        if (v > height) continue;
        const float t = v / height, middle = 0.1f + 0.8f * value(2) + lean * t * t;
        if (std::abs(u - middle) > 0.022f * (1 - t)) continue;
        texel = opaque(mix(V3f(0.04f, 0.11f, 0.015f), V3f(0.30f, 0.38f, 0.09f), t * (0.5f + 0.5f * value(3))));
    }
    return texel;
}

struct Formula {
    std::string_view name;
    Rgba (*image)(float u, float v);
    int log2_size;
};

constexpr std::array formulas = {
    Formula{"tiles", tiles, 9},     Formula{"cobbles", cobbles, 9},   Formula{"asphalt", asphalt, 9},
    Formula{"grass", grass, 9},     Formula{"brick", brick, 9},       Formula{"plaster", plaster, 9},
    Formula{"planks", planks, 9},   Formula{"shingles", shingles, 8}, Formula{"plates", plates, 8},
    Formula{"checker", checker, 8}, Formula{"sign", sign, 9},         Formula{"facade", facade, 9},
    Formula{"clouds", clouds, 9},   Formula{"stripes", stripes, 7},   Formula{"concrete", concrete, 9},
    Formula{"bark", bark, 8},       Formula{"leaves", leaves, 8},     Formula{"lattice", lattice, 8},
    Formula{"blades", blades, 8},
};

}  // namespace

std::shared_ptr<const Texture> procedural_texture(std::string_view name) {
    const auto formula = std::ranges::find(formulas, name, &Formula::name);
    if (formula == formulas.end()) fail(ErrorKind::invalid_argument, "there is no procedural texture \"{}\"", name);
    return std::make_shared<Texture>(formula->log2_size, formula->image);
}

}  // namespace clarus::render
