#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "operator_harness.h"

using namespace clarus;
using namespace clarus::test;
using runtime::Storage;

namespace {

/// bilinear(I; u, v; border) of docs/pipelines.md, "Operators".
double bilinear(const Planes& image, int c, double u, double v, graph::Border border) {
    const int width = image.shape.width, height = image.shape.height;
    if (border == graph::Border::clamp) {
        u = std::clamp(u, 0.0, width - 1.0);
        v = std::clamp(v, 0.0, height - 1.0);
    }
    const double left = std::floor(u), top = std::floor(v);
    double sum = 0;
    for (const double y : {top, top + 1}) {
        for (const double x : {left, left + 1}) {
            const double weight = (1 - std::abs(u - x)) * (1 - std::abs(v - y));
            const bool inside = x >= 0 && x < width && y >= 0 && y < height;
            if (inside && weight > 0) sum += weight * image.at(c, static_cast<int>(x), static_cast<int>(y));
        }
    }
    return sum;
}

struct Case {
    graph::Warp warp;
    graph::Shape render;  // of the fallback
    int channels;         // of the image
    int out_block = 1;
    Storage storage = Storage::f32;
    bool reset = false;
    bool without_fallback = false;
    int samples = 1;  // the image is zero-upsampled by so much
};

Planes expected_warp(const Case& test, const Planes& image, const Planes& motion, const Planes& fallback, Vec2 jitter) {
    const int scale = test.warp.fallback_scale;
    return planes(image.shape, [&](int c, int x, int y) -> float {
        const float mx = motion.at(0, x / test.warp.motion_block, y / test.warp.motion_block);
        const float my = motion.at(1, x / test.warp.motion_block, y / test.warp.motion_block);
        if (!test.reset && std::isfinite(mx) && std::isfinite(my))
            return bilinear(image, c, x + double(mx), y + double(my), test.warp.border);
        if (test.without_fallback || c >= fallback.shape.channels) return 0;
        if (scale == 1) return fallback.at(c, x, y);
        return bilinear(fallback, c, (x + 0.5) / scale - 0.5 - jitter.x, (y + 0.5) / scale - 0.5 - jitter.y,
                        graph::Border::clamp);
    });
}

/// Motion of all kinds: none, whole and broken pixels, to the borders and far beyond, and none that can be used.
float any_motion(std::mt19937& random, int size) {
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    switch (std::uniform_int_distribution(0, 15)(random)) {
        case 0:
            return std::numeric_limits<float>::quiet_NaN();
        case 1:
            return std::uniform_int_distribution(0, 1)(random) ? kInfinity : -kInfinity;
        case 2:
            return 1e30f;
        case 3:
            return -3.0e9f;
        case 4:
            return std::uniform_real_distribution(-1.5f, 1.5f)(random) * static_cast<float>(size);
        case 5:
            return -1e-9f;
        case 6:
        case 7:
            return 0;
        case 8:
        case 9:
            return static_cast<float>(std::uniform_int_distribution(-3, 3)(random));
        default:
            return std::uniform_real_distribution(-6.0f, 6.0f)(random);
    }
}

void check_warp(const Case& test) {
    CAPTURE(test.warp.fallback_scale);
    CAPTURE(test.out_block);
    CAPTURE(test.channels);
    CAPTURE(static_cast<int>(test.storage));
    std::mt19937 random(5);
    const int scale = test.warp.fallback_scale, block = test.warp.motion_block;
    const graph::Shape shape{test.channels, test.render.height * scale, test.render.width * scale};
    const graph::Shape blocks{2, (shape.height + block - 1) / block, (shape.width + block - 1) / block};
    const graph::Shape stored{shape.channels, shape.height / test.samples, shape.width / test.samples};
    const Planes image = rounded(random_planes(stored, random), test.storage);
    const Planes motion =
        planes(blocks, [&](int c, int, int) { return any_motion(random, c == 0 ? shape.width : shape.height); });
    const Planes fallback = rounded(random_planes(test.render, random), test.storage);
    const Vec2 jitter{0.3125f, -0.4375f};

    runtime::Problem problem;
    problem.node = {test.warp, {}, shape, "warp"};
    const int cells = test.channels * test.out_block * test.out_block;
    problem.inputs = {pixel_layout(shape, test.storage), pixel_layout(blocks, Storage::f32),
                      part_layout(test.render, test.storage, 1, test.render.channels + 5, 2)};
    problem.output = test.out_block == 1 ? pixel_layout(shape, test.storage)
                                         : part_layout(shape, test.storage, test.out_block, cells + 10, 6);
    runtime::FrameConstants frame;
    frame.jitter_x = jitter.x;
    frame.jitter_y = jitter.y;
    frame.reset = test.reset;
    std::vector<Planes> inputs{image, motion, fallback};
    if (test.without_fallback) {
        inputs.pop_back();
        problem.inputs.pop_back();
    }
    problem.inputs[0].samples = test.samples;
    problem.inputs[0].previous_samples = test.samples > 1;
    frame.previous_sample_x = test.samples - 1;
    frame.previous_sample_y = test.samples / 2;
    const Planes whole = planes(shape, [&](int c, int x, int y) {
        const bool is_sample =
            x % test.samples == frame.previous_sample_x && y % test.samples == frame.previous_sample_y;
        return is_sample ? image.at(c, x / test.samples, y / test.samples) : 0;
    });
    check_operator(problem, inputs, frame, expected_warp(test, whole, motion, fallback, jitter),
                   storage_tolerance(test.storage));
}

}  // namespace

TEST_CASE("warp writes every pixel's history or its fallback") {
    check_together([&] {
        for (const Storage storage : {Storage::f32, Storage::f16}) {
            check_warp({{graph::Border::clamp, 8, 2}, {3, 26, 37}, 4, 2, storage});
            check_warp({{graph::Border::clamp, 8, 3}, {3, 15, 17}, 4, 3, storage});
            check_warp({{graph::Border::clamp, 8, 4}, {3, 11, 13}, 4, 4, storage});
            check_warp({{graph::Border::zero, 8, 1}, {4, 33, 50}, 4, 1, storage});
            check_warp({{graph::Border::zero, 1, 3}, {12, 7, 9}, 12, 1, storage});
            check_warp({{graph::Border::clamp, 1, 2}, {1, 9, 7}, 3, 2, storage});
            check_warp({{graph::Border::clamp, 1, 2}, {4, 21, 40}, 4, 1, storage});
        }
    });
}

TEST_CASE("warp without a fallback, of zero-upsampled images too") {
    check_together([&] {
        for (const Storage storage : {Storage::f32, Storage::f16}) {
            check_warp({{graph::Border::zero, 1, 1}, {12, 33, 50}, 12, 1, storage, false, true});
            check_warp({{graph::Border::zero, 1, 1}, {8, 17, 31}, 8, 1, storage, true, true});
            check_warp({{graph::Border::zero, 1, 1}, {12, 28, 36}, 12, 1, storage, false, true, 4});
            check_warp({{graph::Border::zero, 1, 1}, {5, 22, 34}, 5, 1, storage, false, true, 2});
            check_warp({{graph::Border::zero, 1, 1}, {12, 15, 21}, 12, 1, storage, true, true, 3});
        }
    });
}

TEST_CASE("warp of a reset frame is all fallback") {
    check_together([&] {
        check_warp({{graph::Border::clamp, 8, 2}, {3, 12, 16}, 4, 2, Storage::f32, true});
        check_warp({{graph::Border::clamp, 8, 1}, {3, 9, 8}, 3, 1, Storage::f32, true});
    });
}

TEST_SUITE("small") {
    TEST_CASE("warp of small images") {
        check_together([&] {
            check_warp({{graph::Border::clamp, 8, 2}, {3, 1, 1}, 4, 2});
            check_warp({{graph::Border::clamp, 8, 2}, {3, 9, 10}, 4, 2});
            check_warp({{graph::Border::zero, 8, 1}, {3, 1, 19}, 3, 1});
            check_warp({{graph::Border::zero, 1, 1}, {12, 5, 5}, 12, 1, Storage::f32, false, true, 5});
            check_warp({{graph::Border::zero, 1, 1}, {12, 6, 7}, 12, 1, Storage::f32, false, true});
        });
    }
}
