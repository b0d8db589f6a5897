#pragma once

#include <algorithm>
#include <cmath>

#include "operator_harness.h"

namespace clarus::test {

/// docs/quantization.md, "Arithmetic": numbers for values.
inline Planes numbers(const Planes& image, const graph::Quantization& quantization) {
    const float inverse = 1 / quantization.scale;
    return planes(image.shape, [&](int c, int x, int y) -> float {
        const float scaled = image.at(c, x, y) * inverse;
        if (std::isnan(scaled)) return 0;
        const double whole = std::nearbyint(static_cast<double>(scaled)) + quantization.zero_point;
        return static_cast<float>(std::clamp(whole, 0.0, 255.0));
    });
}

}  // namespace clarus::test
