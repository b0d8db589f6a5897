#pragma once

#include <cmath>

#include "clarus/types.h"

namespace clarus {

// Of values from 0, by values from 1.
constexpr int ceil_divide(int value, int by) { return (value + by - 1) / by; }
constexpr int round_up(int value, int to) { return ceil_divide(value, to) * to; }

/// An image's size at `scale` times as many pixels, sides rounded to the nearest.
inline Size scaled(Size size, double scale) {
    return {static_cast<int>(std::lround(size.width * scale)), static_cast<int>(std::lround(size.height * scale))};
}

}  // namespace clarus
