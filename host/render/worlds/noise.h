#pragma once

#include <Imath/ImathVec.h>

#include <algorithm>
#include <cmath>

#include "render/texture.h"

namespace clarus::render {

// What patterns are made of. All of it repeats over [0, 1)², and is the same for the same salt.

inline float fraction(float x) { return x - std::floor(x); }
inline float smooth(float t) { return t * t * (3 - 2 * t); }
inline float step_between(float low, float high, float x) {
    return smooth(std::clamp((x - low) / (high - low), 0.0f, 1.0f));
}
inline Imath::V3f mix(const Imath::V3f& a, const Imath::V3f& b, float t) { return a + (b - a) * t; }
inline Rgba opaque(const Imath::V3f& c) { return {c.x, c.y, c.z, 1}; }

/// In [0, 1), a number for a cell of a grid.
float cell_value(int x, int y, int salt);

int wrap(int x, int period);

/// Value noise with `cells_u` by `cells_v` cells.
float noise(float u, float v, int cells_u, int cells_v, int salt);

/// Octaves of noise from `cells` upwards; mean ½.
float fractal(float u, float v, int cells, int octaves, int salt);

/// A place in a grid of bricks whose odd rows are shifted by half a brick.
struct Brick {
    int column, row;
    float x, y;  // within the brick, [0, 1)
    float edge;  // distance to the nearest edge, in rows
};
Brick brick_at(float u, float v, int columns, int rows, bool shifted);

/// A place among pebbles, one a cell of a grid. Distances from the two nearest in cells; `value` is the nearest one's
/// own, in [0, 1).
struct Cell {
    float nearest, second, value;
};
Cell cell_at(float u, float v, int cells, int salt);

}  // namespace clarus::render
