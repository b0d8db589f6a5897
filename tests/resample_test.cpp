#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "operator_harness.h"

using namespace clarus;
using namespace clarus::test;
using runtime::Storage;

namespace {

double triangle(double x) { return std::max(0.0, 1 - std::abs(x)); }

/// Keys' kernel with a = −½.
double keys(double x) {
    x = std::abs(x);
    if (x >= 2) return 0;
    return x <= 1 ? 1.5 * x * x * x - 2.5 * x * x + 1 : -0.5 * x * x * x + 2.5 * x * x - 4 * x + 2;
}

Planes expected_resampling(const Planes& image, const graph::Resample& resample, Size size, Vec2 jitter) {
    const graph::Shape& in = image.shape;
    const auto kernel = resample.filter == graph::Filter::bicubic ? keys : triangle;
    return planes({in.channels, size.height, size.width}, [&](int c, int x, int y) {
        const double u = (x + 0.5) / resample.scale - 0.5 - jitter.x;
        const double v = (y + 0.5) / resample.scale - 0.5 - jitter.y;
        double sum = 0;
        for (int row = static_cast<int>(std::floor(v)) - 1; row <= std::floor(v) + 2; ++row)
            for (int column = static_cast<int>(std::floor(u)) - 1; column <= std::floor(u) + 2; ++column)
                sum += kernel(u - column) * kernel(v - row) *
                       image.at(c, std::clamp(column, 0, in.width - 1), std::clamp(row, 0, in.height - 1));
        return static_cast<float>(sum);
    });
}

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
    const Planes expected = expected_resampling(image, resample, size, {frame.jitter_x, frame.jitter_y});
    runtime::Problem problem;
    problem.node = {resample, {}, expected.shape, "resample"};
    problem.inputs = {part_layout(in, storage, 1, 7, 2)};
    problem.output = block == 1 ? pixel_layout(expected.shape, storage)
                                : part_layout(expected.shape, storage, block, 3 * block * block + 8, 4);
    check_operator(problem, {image}, frame, expected, 2 * storage_tolerance(storage));
}

}  // namespace

TEST_CASE("bilinear and bicubic at any scale") {
    for (const auto filter : {graph::Filter::bilinear, graph::Filter::bicubic}) {
        check_resampling({3, 14, 25}, {filter, 2}, Storage::f32, 2);
        check_resampling({3, 13, 17}, {filter, 1.5}, Storage::f16);
        check_resampling({1, 2, 3500}, {filter, 1.7}, Storage::f32);  // far from the origin as accurate as near it
        check_resampling({3, 11, 9}, {filter, 1}, Storage::f32);
        check_resampling({3, 7, 10}, {filter, 10.0 / 3}, Storage::f32);
    }
}

TEST_SUITE("small") {
    TEST_CASE("filters of small images") {
        check_resampling({3, 1, 1}, {graph::Filter::bicubic, 2}, Storage::f32);
        check_resampling({3, 3, 4}, {graph::Filter::bilinear, 1.3}, Storage::f32);
    }
}
