#include "metrics/masks.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "base/error.h"

namespace clarus::metrics {
namespace {

constexpr uint8_t never = 255;  // hidden, as far as is known
constexpr float relative_tolerance = 0.02f;
constexpr float least_tolerance = 0x1p-16f;
constexpr double moving_from = 0.5;  // render pixels a frame
constexpr double still_below = 1.0 / 16;
constexpr double widest_thin = 2;  // render pixels

bool inside(Size size, int x, int y) { return x >= 0 && y >= 0 && x < size.width && y < size.height; }

/// A surface's own change of depth a pixel along an axis: beside an edge only the other neighbour's is large.
float slope(const io::Pixels& depth, int x, int y, int dx, int dy) {
    const float here = depth.at(x, y, 0);
    const auto difference = [&](int i, int j) { return std::abs(here - depth.at(i, j, 0)); };
    const bool before = inside(depth.size, x - dx, y - dy), after = inside(depth.size, x + dx, y + dy);
    if (before && after) return std::min(difference(x - dx, y - dy), difference(x + dx, y + dy));
    if (before) return difference(x - dx, y - dy);
    return after ? difference(x + dx, y + dy) : 0;
}

float tolerance(const io::Pixels& depth, int x, int y) {
    return relative_tolerance * depth.at(x, y, 0) + 2 * (slope(depth, x, y, 1, 0) + slope(depth, x, y, 0, 1)) +
           least_tolerance;
}

/// Where the pixel's surface was in the frame before, in index coordinates.
struct Place {
    float x = 0, y = 0;
    bool known = false;  // a valid vector that leads to inside the image
};

Place previous_place(const io::Pixels& motion, int x, int y) {
    const float dx = motion.at(x, y, 0), dy = motion.at(x, y, 1);
    if (!std::isfinite(dx) || !std::isfinite(dy)) return {};
    const Place place{x + dx, y + dy, true};
    const bool seen = place.x >= -0.5f && place.y >= -0.5f && place.x <= motion.size.width - 0.5f &&
                      place.y <= motion.size.height - 0.5f;
    return seen ? place : Place{};
}

struct Tap {
    int x = 0, y = 0;
    float weight = 0;
};

/// The four pixels around a place with their bilinear weights; those outside the image have none.
std::array<Tap, 4> taps_of(Size size, const Place& place) {
    const int left = static_cast<int>(std::floor(place.x)), top = static_cast<int>(std::floor(place.y));
    const float u = place.x - left, v = place.y - top;
    std::array<Tap, 4> taps{{{left, top, (1 - u) * (1 - v)},
                             {left + 1, top, u * (1 - v)},
                             {left, top + 1, (1 - u) * v},
                             {left + 1, top + 1, u * v}}};
    for (Tap& tap : taps)
        if (!inside(size, tap.x, tap.y)) tap.weight = 0;
    return taps;
}

/// How much nearer than now surfaces were in the frame before, as a whole: 0 or less, as where the camera moves back. A
/// median weighted by nearness, over a quarter of the rows and columns.
float depth_shift(const io::Pixels& previous, const io::GroundTruth& truth) {
    struct Change {
        float difference, weight;
    };
    std::vector<Change> changes;
    float total = 0;
    for (int y = 0; y < previous.size.height; y += 4) {
        for (int x = 0; x < previous.size.width; x += 4) {
            const Place place = previous_place(truth.motion, x, y);
            const float now = truth.depth.at(x, y, 0);
            if (!place.known || !(now > 0) || now >= 1) continue;
            const float then =
                previous.at(std::clamp(static_cast<int>(std::lround(place.x)), 0, previous.size.width - 1),
                            std::clamp(static_cast<int>(std::lround(place.y)), 0, previous.size.height - 1), 0);
            if (then >= 1) continue;
            changes.push_back({then - now, 1 / now});
            total += 1 / now;
        }
    }
    std::ranges::sort(changes, {}, &Change::difference);
    float sum = 0;
    for (const Change& change : changes)
        if ((sum += change.weight) >= total / 2) return std::min(change.difference, 0.0f);
    return 0;
}

bool is_farther(const io::Pixels& depth, int x, int y, float than) {
    return depth.at(x, y, 0) > than * (1 + relative_tolerance) + least_tolerance;
}

/// How many pixels from (x, y) on, in steps of (dx, dy), are one surface that is nearer than what is beside either end,
/// and less than `most` long; 0 where there is no such run.
int thin_run(const io::Pixels& depth, int x, int y, int dx, int dy, double most) {
    if (!inside(depth.size, x - dx, y - dy) || !is_farther(depth, x - dx, y - dy, depth.at(x, y, 0))) return 0;
    const double step = dx != 0 && dy != 0 ? std::numbers::sqrt2 : 1;
    for (int count = 1; count * step < most; ++count) {
        const float last = depth.at(x + (count - 1) * dx, y + (count - 1) * dy, 0);
        const int i = x + count * dx, j = y + count * dy;
        if (!inside(depth.size, i, j)) return 0;
        if (is_farther(depth, i, j, last)) return count;
        if (last > depth.at(i, j, 0) * (1 + relative_tolerance) + least_tolerance) return 0;
    }
    return 0;
}

/// With every pixel's eight neighbours.
Mask grown(const Mask& mask, Size size) {
    Mask out(mask.size());
    for (int y = 0; y < size.height; ++y)
        for (int x = 0; x < size.width; ++x)
            for (int j = std::max(y - 1, 0); j <= std::min(y + 1, size.height - 1); ++j)
                for (int i = std::max(x - 1, 0); i <= std::min(x + 1, size.width - 1); ++i)
                    out[static_cast<size_t>(y) * size.width + x] |= mask[static_cast<size_t>(j) * size.width + i];
    return out;
}

}  // namespace

Mask thin_mask(const io::Pixels& depth, double scale) {
    constexpr std::array<std::array<int, 2>, 4> directions{{{1, 0}, {0, 1}, {1, 1}, {1, -1}}};
    Mask mask(depth.values.size());
    for (int y = 0; y < depth.size.height; ++y)
        for (int x = 0; x < depth.size.width; ++x)
            for (const auto& [dx, dy] : directions)
                for (int i = thin_run(depth, x, y, dx, dy, widest_thin * scale) - 1; i >= 0; --i)
                    mask[static_cast<size_t>(y + i * dy) * depth.size.width + x + i * dx] = 1;
    return grown(mask, depth.size);
}

MaskMaker::Sight MaskMaker::followed(const io::GroundTruth& truth, int x, int y, float depth_shift) const {
    const Place place = previous_place(truth.motion, x, y);
    if (!place.known) return {.age = 0};
    const float expected = truth.depth.at(x, y, 0) + depth_shift, within = tolerance(truth.depth, x, y);
    float weight = 0, in_front = 0, best = std::numeric_limits<float>::infinity();
    Sight found{.age = 0};
    for (const Tap& tap : taps_of(truth.depth.size, place)) {
        if (tap.weight <= 0) continue;
        const float there = previous_depth_.at(tap.x, tap.y, 0);
        weight += tap.weight;
        if (there < expected - within) in_front += tap.weight;
        const Sight& sight = sights_[static_cast<size_t>(tap.y) * truth.depth.size.width + tap.x];
        const float dx = tap.x + sight.x - place.x, dy = tap.y + sight.y - place.y;
        // A tap of another surface counts only where there is none of this one.
        const float distance = std::hypot(dx, dy) + (std::abs(there - expected) > within ? 10.0f : 0.0f);
        if (distance >= best) continue;
        best = distance;
        found = {static_cast<uint8_t>(std::min(sight.age + 1, int{never})), dx, dy};
    }
    return 2 * in_front > weight ? Sight{.age = 0} : found;
}

Masks MaskMaker::add(const io::GroundTruth& truth, bool follows) {
    const Size size = truth.depth.size;
    if (truth.motion.size != size || (follows && previous_depth_.size != size))
        fail(ErrorKind::invalid_argument,
             "masks need depth and motion of one size; {}x{} pixels of depth, {}x{} of motion", size.width, size.height,
             truth.motion.size.width, truth.motion.size.height);
    const size_t count = truth.depth.values.size();
    std::vector<Sight> sights(count, Sight{.age = never});
    if (follows) {
        const float shift = depth_shift(previous_depth_, truth);
        for (int y = 0; y < size.height; ++y)
            for (int x = 0; x < size.width; ++x)
                sights[static_cast<size_t>(y) * size.width + x] = followed(truth, x, y, shift);
    }
    sights_ = std::move(sights);
    previous_depth_ = truth.depth;

    Masks out;
    out.masks.fill(Mask(count));
    out[Region::thin] = thin_mask(truth.depth, scale_);
    if (!follows) return out;
    for (size_t i = 0; i < count; ++i) {
        const double motion = std::hypot(truth.motion.values[2 * i], truth.motion.values[2 * i + 1]) / scale_;
        out[Region::disoccluded_1][i] = sights_[i].age < 1;
        out[Region::disoccluded_4][i] = sights_[i].age < 4;
        out[Region::disoccluded_8][i] = sights_[i].age < 8;
        out[Region::moving][i] = motion >= moving_from;
        out[Region::still][i] = motion < still_below && sights_[i].age >= 8;
    }
    return out;
}

}  // namespace clarus::metrics
