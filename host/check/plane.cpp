#include "check/plane.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace clarus::check {
namespace {

/// 1-2-1 along `step`, of lines of `length` values that begin at multiples of `pitch`.
std::vector<float> smoothed_lines(const std::vector<float>& in, int length, int step, int lines, int pitch) {
    std::vector<float> out(in.size());
    for (int line = 0; line < lines; ++line)
        for (int i = 0; i < length; ++i) {
            const auto value = [&](int at) {
                const int inside = std::clamp(at, 0, length - 1);
                return in[static_cast<size_t>(line) * pitch + static_cast<size_t>(inside) * step];
            };
            out[static_cast<size_t>(line) * pitch + static_cast<size_t>(i) * step] =
                0.25f * value(i - 1) + 0.5f * value(i) + 0.25f * value(i + 1);
        }
    return out;
}

std::array<float, 4> catmull_rom(float t) {
    return {((-0.5f * t + 1) * t - 0.5f) * t, (1.5f * t - 2.5f) * t * t + 1, ((-1.5f * t + 2) * t + 0.5f) * t,
            (0.5f * t - 0.5f) * t * t};
}

}  // namespace

Plane smooth_luma(const io::Pixels& color) {
    Plane plane{color.size, {}};
    plane.values.reserve(color.values.size() / 3);
    const bool is_bright = std::ranges::any_of(color.values, [](float value) { return value > 1; });
    for (size_t i = 0; i + 2 < color.values.size(); i += 3) {
        float luma = 0.299f * color.values[i] + 0.587f * color.values[i + 1] + 0.114f * color.values[i + 2];
        if (!(luma > 0)) luma = 0;
        if (is_bright) luma = std::isinf(luma) ? 1 : std::sqrt(luma / (1 + luma));
        plane.values.push_back(luma);
    }
    return smoothed(std::move(plane));
}

Plane smoothed(Plane plane) {
    const auto [width, height] = plane.size;
    plane.values = smoothed_lines(plane.values, width, 1, height, width);
    plane.values = smoothed_lines(plane.values, height, width, width, 1);
    return plane;
}

float sample(const Plane& plane, float x, float y) {
    const float left = std::floor(x), top = std::floor(y);
    const std::array<float, 4> across = catmull_rom(x - left), down = catmull_rom(y - top);
    const int i = static_cast<int>(left), j = static_cast<int>(top);
    const auto [width, height] = plane.size;
    float sum = 0;
    for (int row = 0; row < 4; ++row) {
        const float* line =
            &plane.values[static_cast<size_t>(std::clamp(j - 1 + row, 0, height - 1)) * static_cast<size_t>(width)];
        float value = 0;
        for (int column = 0; column < 4; ++column)
            value += across[static_cast<size_t>(column)] * line[std::clamp(i - 1 + column, 0, width - 1)];
        sum += down[static_cast<size_t>(row)] * value;
    }
    return sum;
}

std::vector<Plane> depth_ranks(std::span<const io::Pixels> stored) {
    constexpr size_t most_samples = 4096;
    size_t count = 0;
    for (const io::Pixels& depth : stored) count += depth.values.size();
    const size_t step = std::max<size_t>(1, count / most_samples);
    std::vector<float> samples;
    for (const io::Pixels& depth : stored)
        for (size_t i = 0; i < depth.values.size(); i += step)
            if (std::isfinite(depth.values[i])) samples.push_back(depth.values[i]);
    std::ranges::sort(samples);

    const auto rank = [&](float value) {
        if (samples.empty() || !(value <= samples.back())) return 1.0f;
        const auto above = std::ranges::lower_bound(samples, value);
        const float whole = static_cast<float>(above - samples.begin());
        if (above == samples.begin() || *above == value) return whole / static_cast<float>(samples.size());
        const float below = *(above - 1);
        return (whole - 1 + (value - below) / (*above - below)) / static_cast<float>(samples.size());
    };
    std::vector<Plane> planes;
    for (const io::Pixels& depth : stored) {
        planes.push_back({depth.size, {}});
        planes.back().values.reserve(depth.values.size());
        for (const float value : depth.values) planes.back().values.push_back(rank(value));
    }
    return planes;
}

}  // namespace clarus::check
