#pragma once

#include <cmath>

namespace clarus {

/// The sRGB transfer function, from linear light to what a display is given, and back; both of values from 0.
inline float encode_srgb(float y) { return y <= 0.0031308f ? 12.92f * y : 1.055f * std::pow(y, 1 / 2.4f) - 0.055f; }
inline float decode_srgb(float x) { return x <= 0.04045f ? x / 12.92f : std::pow((x + 0.055f) / 1.055f, 2.4f); }

}  // namespace clarus
