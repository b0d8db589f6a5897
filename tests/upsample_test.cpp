#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "operator_harness.h"

using namespace clarus;
using namespace clarus::test;
using runtime::Storage;

namespace {

Planes expected_upsampling(const Planes& image, int scale, Vec2 jitter) {
    const graph::Shape& in = image.shape;
    const auto taps = [&](int position, float shift, int size) {
        const double u = std::clamp((position + 0.5) / scale - 0.5 - shift, 0.0, size - 1.0);
        const int first = static_cast<int>(u);
        return std::tuple{first, std::min(first + 1, size - 1), u - first};
    };
    return planes({in.channels, in.height * scale, in.width * scale}, [&](int c, int x, int y) {
        const auto [left, right, fx] = taps(x, jitter.x, in.width);
        const auto [top, bottom, fy] = taps(y, jitter.y, in.height);
        const double above = (1 - fx) * image.at(c, left, top) + fx * image.at(c, right, top);
        const double below = (1 - fx) * image.at(c, left, bottom) + fx * image.at(c, right, bottom);
        return static_cast<float>((1 - fy) * above + fy * below);
    });
}

struct Part {
    int block = 1, stride = 0, offset = 0;
};

void check_upsampling(graph::Shape in, int scale, graph::Shift shift, Storage storage, Part from = {}, Part to = {}) {
    CAPTURE(scale);
    CAPTURE(static_cast<int>(shift));
    std::mt19937 random(9);
    const Planes image = rounded(random_planes(in, random), storage);
    const auto layout = [&](graph::Shape shape, Part part) {
        return part.stride == 0 ? pixel_layout(shape, storage)
                                : part_layout(shape, storage, part.block, part.stride, part.offset);
    };
    runtime::FrameConstants frame;
    frame.jitter_x = -0.46875f;
    frame.jitter_y = 0.8125f;
    frame.motion_jitter_x = 0.21875f;
    frame.motion_jitter_y = -1.0f;
    Vec2 jitter{0, 0};
    if (shift == graph::Shift::jitter) jitter = {frame.jitter_x, frame.jitter_y};
    if (shift == graph::Shift::motion_jitter) jitter = {frame.motion_jitter_x, frame.motion_jitter_y};

    const Planes expected = expected_upsampling(image, scale, jitter);
    runtime::Problem problem;
    problem.node = {graph::Upsample{scale, shift}, {}, expected.shape, "upsample"};
    problem.inputs = {layout(in, from)};
    problem.output = layout(expected.shape, to);
    check_operator(problem, {image}, frame, expected, storage_tolerance(storage));
}

}  // namespace

TEST_CASE("upsample is bilinear around the jittered samples") {
    for (const auto shift : {graph::Shift::none, graph::Shift::jitter, graph::Shift::motion_jitter})
        check_upsampling({3, 15, 23}, 2, shift, Storage::f32);
    check_upsampling({3, 17, 31}, 3, graph::Shift::jitter, Storage::f32, {1, 24, 0}, {3, 44, 6});
    check_upsampling({4, 16, 20}, 4, graph::Shift::jitter, Storage::f16, {2, 20, 3}, {});
    check_upsampling({1, 6, 3000}, 3, graph::Shift::jitter, Storage::f32);
    check_upsampling({2, 9, 9}, 1, graph::Shift::none, Storage::f16);
}

TEST_SUITE("small") {
    TEST_CASE("upsample of small images") {
        check_upsampling({3, 1, 1}, 2, graph::Shift::jitter, Storage::f32, {}, {2, 24, 6});
        check_upsampling({1, 5, 3}, 6, graph::Shift::motion_jitter, Storage::f16);
    }
}
