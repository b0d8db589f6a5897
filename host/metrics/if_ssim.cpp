#include "metrics/if_ssim.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/error.h"
#include "metrics/display.h"
#include "metrics/ssim.h"

namespace clarus::metrics {
namespace {

constexpr float depth_tolerance = 0.01f;

double mix(double a, double b, double share) { return a + (b - a) * share; }

/// `image` where the surfaces were, bilinear, its edge repeated. An invalid vector counts as none: masked anyway.
io::Pixels warp(const io::Pixels& image, const io::Pixels& motion) {
    const auto [width, height] = image.size;
    io::Pixels warped{image.size, image.channels, std::vector<float>(image.values.size())};
    float* out = warped.values.data();
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            const float dx = motion.at(x, y, 0), dy = motion.at(x, y, 1);
            const double from_x = std::clamp(x + (std::isnan(dx) ? 0.0 : dx), 0.0, width - 1.0);
            const double from_y = std::clamp(y + (std::isnan(dy) ? 0.0 : dy), 0.0, height - 1.0);
            const int left = static_cast<int>(from_x), top = static_cast<int>(from_y);
            const int right = std::min(left + 1, width - 1), bottom = std::min(top + 1, height - 1);
            const double u = from_x - left, v = from_y - top;
            for (int c = 0; c < image.channels; ++c) {
                const double upper = mix(image.at(left, top, c), image.at(right, top, c), u);
                const double lower = mix(image.at(left, bottom, c), image.at(right, bottom, c), u);
                *out++ = static_cast<float>(mix(upper, lower, v));
            }
        }
    }
    return warped;
}

Size pooled(Size size) { return {size.width / 2, size.height / 2}; }

/// The mean of every 2×2 pixels where the mask is 1, elsewhere 0.
io::Pixels pool(const io::Pixels& image, const std::vector<uint8_t>& mask) {
    const Size size = pooled(image.size);
    io::Pixels means{size, image.channels, std::vector<float>(mask.size() * image.channels)};
    for (int y = 0; y < size.height; ++y) {
        for (int x = 0; x < size.width; ++x) {
            if (!mask[static_cast<size_t>(y) * size.width + x]) continue;
            for (int c = 0; c < image.channels; ++c)
                means.at(x, y, c) = (image.at(2 * x, 2 * y, c) + image.at(2 * x + 1, 2 * y, c) +
                                     image.at(2 * x, 2 * y + 1, c) + image.at(2 * x + 1, 2 * y + 1, c)) /
                                    4;
        }
    }
    return means;
}

/// The mean over the three channels of the 5×5 pixels around (x, y), in 8-bit levels.
double brightness(const io::Pixels& image, int x, int y) {
    double sum = 0;
    for (int j = y - 2; j <= y + 2; ++j)
        for (int i = x - 2; i <= x + 2; ++i)
            for (int c = 0; c < 3; ++c)
                sum += image.at(std::clamp(i, 0, image.size.width - 1), std::clamp(j, 0, image.size.height - 1), c);
    return sum / (25 * 3) * 255;
}

double largest_difference(const io::Pixels& a, const io::Pixels& b, int x, int y) {
    double largest = 0;
    for (int c = 0; c < 3; ++c)
        largest = std::max(largest, std::abs(static_cast<double>(a.at(x, y, c)) - b.at(x, y, c)));
    return largest * 255;
}

}  // namespace

double visible_difference(double brightness) {
    struct Point {
        double brightness, difference;
    };
    constexpr std::array<Point, 6> curve{{{0, 6}, {32, 8}, {64, 10}, {128, 14}, {192, 18}, {255, 22}}};
    const auto above = std::find_if(curve.begin() + 1, curve.end() - 1,
                                    [&](const Point& point) { return brightness < point.brightness; });
    const auto below = above - 1;
    return mix(below->difference, above->difference,
               (brightness - below->brightness) / (above->brightness - below->brightness));
}

InterFrame::InterFrame(const io::Pixels& previous_reference, const io::Pixels& previous_depth,
                       const io::Pixels& reference, const io::GroundTruth& truth)
    : motion_(truth.motion) {
    require_comparable(reference, previous_reference);
    const Size size = reference.size;
    for (const io::Pixels* image : {&previous_depth, &truth.depth, &truth.motion})
        if (image->size != size)
            fail(ErrorKind::invalid_argument, "depth or motion of {}x{} pixels cannot go with a reference of {}x{}",
                 image->size.width, image->size.height, size.width, size.height);

    const io::Pixels warped_depth = warp(previous_depth, motion_);
    const io::Pixels warped_reference = warp(previous_reference, motion_);
    const auto passes = [&](int x, int y) {
        if (std::isnan(motion_.at(x, y, 0)) || std::isnan(motion_.at(x, y, 1))) return false;
        if (!(std::abs(warped_depth.at(x, y, 0) - truth.depth.at(x, y, 0)) < depth_tolerance)) return false;
        return largest_difference(reference, warped_reference, x, y) < visible_difference(brightness(reference, x, y));
    };
    for (int y = 0; y + 1 < size.height; y += 2)
        for (int x = 0; x + 1 < size.width; x += 2)
            mask_.push_back(passes(x, y) && passes(x + 1, y) && passes(x, y + 1) && passes(x + 1, y + 1));
}

std::optional<double> InterFrame::ssim(const io::Pixels& previous, const io::Pixels& current) const {
    require_comparable(previous, current);
    if (current.size != motion_.size)
        fail(ErrorKind::invalid_argument, "frames of {}x{} pixels cannot be aligned by motion of {}x{}",
             current.size.width, current.size.height, motion_.size.width, motion_.size.height);
    if (mask_.empty()) return std::nullopt;
    return metrics::ssim(pool(warp(previous, motion_), mask_), pool(current, mask_));
}

}  // namespace clarus::metrics
