#pragma once

#include <cstddef>
#include <vector>

#include "clarus/types.h"

namespace clarus::check {

/// Whether vectors follow the jitter, and how. A camera moves smoothly, jitter does not: what is left of the median
/// vectors without a parabola over time is set against what is left of the jitter's changes.
struct JitterInMotion {
    bool is_there = false, is_absent = false;  // for sure; neither where nothing can be told
    bool x_flipped = false, y_flipped = false, axes_swapped = false;
    double gain = 0;   // dB, of squares: of the best answer over the second
    size_t count = 0;  // pairs
};

/// A pair of frames each: the median vector, and the change of the JSON's jitter; in render pixels.
JitterInMotion find_jitter_in_motion(const std::vector<Vec2>& motion, const std::vector<Vec2>& jitter);

}  // namespace clarus::check
