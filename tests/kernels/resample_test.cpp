#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "filter_kernels.h"
#include "operator_harness.h"

using namespace clarus;
using namespace clarus::test;
using runtime::Storage;

namespace {

/// Around index coordinate u: the taps' pixels, clamped to an axis of `size`, and their weights, which sum to 1.
std::vector<std::pair<int, double>> taps_around(graph::Filter filter, double u, int size) {
    if (filter == graph::Filter::nearest)
        return {{std::clamp(static_cast<int>(std::floor(u + 0.501)), 0, size - 1), 1.0}};
    const auto kernel = filter == graph::Filter::bilinear  ? triangle
                        : filter == graph::Filter::bicubic ? keys
                                                           : lanczos;
    std::vector<std::pair<int, double>> taps;
    double sum = 0;
    for (int tap = static_cast<int>(std::floor(u)) - 2; tap <= std::floor(u) + 3; ++tap) {
        taps.emplace_back(std::clamp(tap, 0, size - 1), kernel(u - tap));
        sum += taps.back().second;
    }
    for (auto& [pixel, weight] : taps) weight /= sum;
    return taps;
}

Planes expected_resampling(const Planes& image, const graph::Resample& resample, Size size, Vec2 jitter) {
    const graph::Shape& in = image.shape;
    return planes({in.channels, size.height, size.width}, [&](int c, int x, int y) {
        const double u = (x + 0.5) / resample.scale - 0.5 - jitter.x;
        const double v = (y + 0.5) / resample.scale - 0.5 - jitter.y;
        double sum = 0;
        for (const auto& [row, row_weight] : taps_around(resample.filter, v, in.height))
            for (const auto& [column, column_weight] : taps_around(resample.filter, u, in.width))
                sum += row_weight * column_weight * image.at(c, column, row);
        return static_cast<float>(resample.clamped ? std::clamp(sum, 0.0, 1.0) : sum);
    });
}

constexpr auto kFilters = {graph::Filter::nearest, graph::Filter::bilinear, graph::Filter::bicubic,
                           graph::Filter::lanczos};

void check_resampling(graph::Shape in, graph::Resample resample, Storage storage, int block = 1) {
    CAPTURE(resample.scale);
    CAPTURE(static_cast<int>(resample.filter));
    std::mt19937 random(2);
    const Planes image = rounded(random_planes(in, random), storage);
    const Size size{static_cast<int>(std::lround(in.width * resample.scale)),
                    static_cast<int>(std::lround(in.height * resample.scale))};
    runtime::FrameConstants frame;
    frame.jitter_x = 0.375f;
    frame.jitter_y = -0.71875f;
    frame.motion_jitter_x = 0.25f;
    frame.motion_jitter_y = 0.125f;
    Vec2 jitter{0, 0};
    if (resample.shift == graph::Shift::jitter) jitter = {frame.jitter_x, frame.jitter_y};
    if (resample.shift == graph::Shift::motion_jitter) jitter = {frame.motion_jitter_x, frame.motion_jitter_y};
    const Planes expected = expected_resampling(image, resample, size, jitter);
    runtime::Problem problem;
    problem.node = {resample, {}, expected.shape, "resample"};
    // As images come from ingest, or as a part of something.
    problem.inputs = {block == 1 || in.channels == 4
                          ? part_layout(in, storage, 1, in.channels <= 4 ? 4 : in.channels + 4, 0)
                          : part_layout(in, storage, 1, in.channels + 4, 2)};
    problem.output = block == 1 ? pixel_layout(expected.shape, storage)
                                : part_layout(expected.shape, storage, block, in.channels * block * block + 8, 4);
    check_operator(problem, {image}, frame, expected, 2 * storage_tolerance(storage));
}

}  // namespace

TEST_CASE("filters at any scale") {
    check_together([&] {
        for (const auto filter : kFilters) {
            check_resampling({3, 14, 25}, {filter, 2}, Storage::f32, 2);
            check_resampling({3, 14, 91}, {filter, 2}, Storage::f32);
            check_resampling({3, 13, 170}, {filter, 1.5}, Storage::f16);
            check_resampling({1, 2, 3500}, {filter, 1.7}, Storage::f32);  // far from the origin as accurate as near it
            check_resampling({3, 2, 3500}, {filter, 1.7}, Storage::f32);
            check_resampling({1, 13, 170}, {filter, 1.5}, Storage::f16);
            check_resampling({3, 11, 90}, {filter, 1}, Storage::f32);
            check_resampling({3, 7, 40}, {filter, 10.0 / 3}, Storage::f32);
            check_resampling({3, 9, 40}, {filter, 6}, Storage::f32);
            check_resampling({3, 3, 11}, {filter, 23.7}, Storage::f32);
            check_resampling({5, 6, 7}, {filter, 3, graph::Shift::none}, Storage::f32);
            check_resampling({3, 19, 37}, {filter, 2, graph::Shift::none}, Storage::f16);
            check_resampling({3, 19, 37}, {filter, 3, graph::Shift::motion_jitter}, Storage::f32);
            check_resampling({3, 40, 90}, {filter, 2.0 / 3, graph::Shift::none}, Storage::f32);
            check_resampling({4, 15, 21}, {filter, 4.0 / 3, graph::Shift::none, false}, Storage::f32);
            check_resampling({4, 15, 21}, {filter, 4.0 / 3, graph::Shift::none, false}, Storage::f16, 4);
            check_resampling({3, 20, 36}, {filter, 0.75, graph::Shift::none, false}, Storage::f32);
            check_resampling({3, 20, 36}, {filter, 0.3, graph::Shift::none, false}, Storage::f16);
        }
    });
}

TEST_SUITE("small") {
    TEST_CASE("filters of small images") {
        check_together([&] {
            for (const auto filter : kFilters) {
                check_resampling({3, 1, 1}, {filter, 2}, Storage::f32);
                check_resampling({3, 3, 4}, {filter, 1.3}, Storage::f32);
                check_resampling({4, 3, 4}, {filter, 1.3, graph::Shift::none, false}, Storage::f32);
                check_resampling({3, 3, 4}, {filter, 0.5, graph::Shift::none, false}, Storage::f32);
            }
        });
    }
}
