#pragma once

#include <span>
#include <vector>

#include "clarus/types.h"
#include "io/image.h"

namespace clarus::check {

/// One value a pixel, rows top to bottom; index coordinates (docs/conventions.md, "Image grid").
struct Plane {
    Size size;
    std::vector<float> values;

    float at(int x, int y) const { return values[static_cast<size_t>(y) * size.width + x]; }
    bool contains(float x, float y) const {
        return x >= -0.5f && y >= -0.5f && x <= static_cast<float>(size.width) - 0.5f &&
               y <= static_cast<float>(size.height) - 0.5f;
    }
};

/// Luma of colour (3 channels), smoothed by the binomial 1-2-1 along both axes: that takes away what aliasing adds, and
/// with it the advantage that a place between pixels, where interpolation smooths, has over a pixel's centre. Images
/// with values above 1 are compressed first, x / (1 + x) and a square root. NaN counts as 0.
Plane smooth_luma(const io::Pixels& color);

/// The binomial alone.
Plane smoothed(Plane plane);

/// Catmull-Rom, borders repeated; the place must lie in the plane.
float sample(const Plane& plane, float x, float y);

/// The share of all depths that are smaller, for every depth image of `stored` (1 channel): whatever the encoding,
/// steps between things become steps of this. NaN counts as the largest.
std::vector<Plane> depth_ranks(std::span<const io::Pixels> stored);

}  // namespace clarus::check
