#include "clarus/jitter.h"

#include <random>

#include "base/error.h"

namespace clarus {
namespace {

double radical_inverse(int index, int base) {
    double value = 0, digit_weight = 1;
    for (; index > 0; index /= base) {
        digit_weight /= base;
        value += digit_weight * (index % base);
    }
    return value;
}

Vec2 sub_pixel_centre(int a, int b, int scale) {
    return {static_cast<float>((a + 0.5) / scale - 0.5), static_cast<float>((b + 0.5) / scale - 0.5)};
}

void require_least(const char* argument, int value, int least) {
    if (value < least) fail(ErrorKind::invalid_argument, "{}: {}; must be {} or more", argument, value, least);
}

}  // namespace

Vec2 halton_jitter(int frame, int count) {
    require_least("frame", frame, 0);
    require_least("count", count, 1);
    const int index = frame % count + 1;
    return {static_cast<float>(radical_inverse(index, 2) - 0.5), static_cast<float>(radical_inverse(index, 3) - 0.5)};
}

Vec2 mnss_jitter(int frame, int scale) {
    require_least("frame", frame, 0);
    if (scale == 2) {
        // Sums of the speeds {1, 0} and {1, 1, 0} before this frame.
        const int a = (frame + 1) / 2 % 2, b = (frame - frame / 3) % 2;
        return sub_pixel_centre(a, b, scale);
    }
    if (scale == 3) {
        constexpr int order[9][2] = {{0, 0}, {1, 1}, {2, 1}, {0, 2}, {2, 0}, {2, 2}, {0, 1}, {1, 2}, {1, 0}};
        const auto& [a, b] = order[frame % 9];
        return sub_pixel_centre(a, b, scale);
    }
    fail(ErrorKind::invalid_argument, "the MNSS pattern is for the scales 2 and 3, not {}", scale);
}

Vec2 random_jitter(int frame, int scale) {
    require_least("frame", frame, 0);
    require_least("scale", scale, 1);
    // The generator's numbers are the standard's, the same everywhere; its distributions are not.
    std::mt19937 chance(static_cast<uint32_t>(frame));
    const auto count = static_cast<uint32_t>(scale);
    const uint32_t chosen = static_cast<uint32_t>(chance()) % (count * count);
    return sub_pixel_centre(static_cast<int>(chosen % count), static_cast<int>(chosen / count), scale);
}

}  // namespace clarus
