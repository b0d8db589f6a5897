#pragma once

#include <array>
#include <limits>
#include <random>

#include "operator_harness.h"

/// Motion and depth of all kinds, and where they lead (docs/history.md), pixel by pixel.
namespace clarus::test {

inline constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
inline constexpr float kInfinity = std::numeric_limits<float>::infinity();

struct Point {
    double x, y;
};

struct Tap {
    int x, y;
    double weight_x, weight_y;
    double weight() const { return weight_x * weight_y; }
};

/// The four pixels around a point, in raster order.
std::array<Tap, 4> taps_around(Point point);

bool is_valid(const Planes& motion, int x, int y);
bool is_inside(const graph::Shape& shape, int x, int y);

/// Where a pixel with a valid vector was at a share of the way to the previous frame; far outside, no farther than taps
/// can be numbered.
Point previous_place(const Planes& motion, int x, int y, Vec2 jitter, double share = 1);

/// previous_depth, or landed_depth of docs/interpolate.md at a share of the way.
Planes expected_previous_depth(const Planes& motion, const Planes& depth, Vec2 jitter, double share = 1);

/// Motion of all kinds in steps that floats hold exactly, so that thresholds are met exactly too: smooth, apart, none,
/// across the borders, far beyond them, and none that can be used.
Planes any_motion(graph::Shape size, std::mt19937& random);

/// Surfaces at few distances, some of them sloping, so that there are ties and silhouettes.
Planes any_depth(graph::Shape size, std::mt19937& random);

runtime::FrameConstants frame_with(Vec2 jitter, Vec2 motion_jitter);

}  // namespace clarus::test
