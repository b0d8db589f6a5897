#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

// Kernels of filters by their definitions; distances in pixels.
namespace clarus::test {

inline double triangle(double x) { return std::max(0.0, 1 - std::abs(x)); }

/// Keys' kernel with a = −½.
inline double keys(double x) {
    x = std::abs(x);
    if (x >= 2) return 0;
    return x <= 1 ? 1.5 * x * x * x - 2.5 * x * x + 1 : -0.5 * x * x * x + 2.5 * x * x - 4 * x + 2;
}

/// Lanczos-3.
inline double lanczos(double x) {
    if (x == 0) return 1;
    const double angle = std::numbers::pi * x;
    return std::abs(x) >= 3 ? 0 : 3 * std::sin(angle) * std::sin(angle / 3) / (angle * angle);
}

}  // namespace clarus::test
