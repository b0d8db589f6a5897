#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

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

/// s · upsample(m, s, J_m): a tap of a vector that is not finite makes the result invalid where its weight along each
/// axis exceeds 10⁻³, and else adds nothing.
void check_motion(Size render, int scale, Vec2 jitter) {
    CAPTURE(scale);
    CAPTURE(render.width);
    CAPTURE(jitter.x);
    constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
    std::mt19937 random(3);
    Planes motion = random_planes({2, render.height, render.width}, random, -9, 9);
    for (int y = 0; y < render.height; ++y)
        for (int x = 0; x < render.width; ++x)
            if (random() % 8 == 0) motion.at(0, x, y) = motion.at(1, x, y) = kNan;
    const auto tap = [&](int position, float shift, int size, int which) {
        const double u = (position + 0.5) / scale - 0.5 - shift, whole = std::floor(u);
        return std::pair{std::clamp(static_cast<int>(whole) + which, 0, size - 1), which ? u - whole : 1 - (u - whole)};
    };
    const Planes expected = planes({2, render.height * scale, render.width * scale}, [&](int c, int x, int y) {
        double sum = 0;
        for (const int row : {0, 1}) {
            for (const int column : {0, 1}) {
                const auto [j, weight_y] = tap(y, jitter.y, render.height, row);
                const auto [i, weight_x] = tap(x, jitter.x, render.width, column);
                const float value = motion.at(c, i, j);
                if (!std::isnan(value))
                    sum += weight_x * weight_y * value;
                else if (weight_x > 1e-3 && weight_y > 1e-3)
                    return kNan;
            }
        }
        return static_cast<float>(scale * sum);
    });
    runtime::FrameConstants frame;
    frame.motion_jitter_x = jitter.x;
    frame.motion_jitter_y = jitter.y;
    runtime::Problem problem;
    problem.node = {graph::UpsampleMotion{scale}, {}, expected.shape, "motion"};
    problem.inputs = {part_layout(motion.shape, Storage::f32, 1, 4, 0)};
    problem.output = part_layout(expected.shape, Storage::f32, 1, 4, 1);
    // Sums of terms up to 45.
    check_operator(problem, {motion}, frame, expected, 2e-5f);
}

}  // namespace

TEST_CASE("upsample is bilinear around the jittered samples") {
    for (const auto shift : {graph::Shift::none, graph::Shift::jitter, graph::Shift::motion_jitter})
        check_upsampling({3, 15, 23}, 2, shift, Storage::f32);
    check_upsampling({3, 17, 31}, 3, graph::Shift::jitter, Storage::f32, {1, 24, 0}, {3, 44, 6});
    check_upsampling({4, 16, 20}, 4, graph::Shift::jitter, Storage::f16, {2, 20, 3}, {});
    check_upsampling({1, 6, 3000}, 3, graph::Shift::jitter, Storage::f32);
    check_upsampling({2, 9, 9}, 1, graph::Shift::none, Storage::f16);
    // Pixels four elements apart, and parts of such.
    for (const int width : {1, 3, 4, 66, 131}) {
        for (const int channels : {1, 2, 3, 4})
            check_upsampling({channels, 5, width}, 2, graph::Shift::jitter, Storage::f32, {1, 4, 0}, {1, 5, 1});
        check_upsampling({1, 4, width}, 3, graph::Shift::motion_jitter, Storage::f16, {1, 4, 3}, {1, 4, 3});
    }
}

TEST_CASE("motion is upsampled, and invalid where a tap that counts is") {
    for (const int scale : {1, 2, 3, 5})
        for (const int width : {1, 6, 67})
            for (const Vec2 jitter : {Vec2{0, 0}, {-0.25f, 0.25f}, {1.0f / 3, -1.0f / 3}, {-1, 0.4995f}})
                check_motion({width, 9}, scale, jitter);
}

TEST_SUITE("small") {
    TEST_CASE("upsample of small images") {
        check_upsampling({3, 1, 1}, 2, graph::Shift::jitter, Storage::f32, {}, {2, 24, 6});
        check_upsampling({1, 5, 3}, 6, graph::Shift::motion_jitter, Storage::f16);
    }
}
