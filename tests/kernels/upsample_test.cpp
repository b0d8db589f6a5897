#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "operator_harness.h"
#include "test_device.h"

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

/// M = s · upsample(m, s, J_m) of docs/pipelines.md.
void check_motion_upsampling(Size size, int scale, Vec2 jitter) {
    CAPTURE(scale);
    std::mt19937 random(11);
    std::uniform_int_distribution<int> kind(0, 9);
    const Planes motion = planes({2, size.height, size.width}, [&](int, int, int) {
        return kind(random) ? std::uniform_real_distribution(-5.0f, 5.0f)(random)
                            : std::numeric_limits<float>::quiet_NaN();
    });
    const auto valid = [&](int x, int y) {
        return std::isfinite(motion.at(0, x, y)) && std::isfinite(motion.at(1, x, y));
    };
    const Planes zeroed =
        planes(motion.shape, [&](int c, int x, int y) { return valid(x, y) ? motion.at(c, x, y) : 0; });
    const Planes upsampled = expected_upsampling(zeroed, scale, jitter);
    // Where invalid vectors are 1, whatever is not 0 has a part of one; weights here are 0 or above 10⁻².
    const Planes invalid = expected_upsampling(
        planes({1, size.height, size.width}, [&](int, int x, int y) { return valid(x, y) ? 0.0f : 1.0f; }), scale,
        jitter);
    const Planes expected = planes(upsampled.shape, [&](int c, int x, int y) {
        return invalid.at(0, x, y) > 0 ? std::numeric_limits<float>::quiet_NaN() : scale * upsampled.at(c, x, y);
    });
    runtime::FrameConstants frame;
    frame.motion_jitter_x = jitter.x;
    frame.motion_jitter_y = jitter.y;
    runtime::Problem problem;
    problem.node = {graph::UpsampleMotion{scale}, {}, expected.shape, "motion upsampling"};
    problem.inputs = {part_layout(motion.shape, Storage::f32, 1, 4, 1)};
    problem.output = pixel_layout(expected.shape, Storage::f32);
    check_operator(problem, {motion}, frame, expected, 1e-5f);  // sums of vectors up to 5 · scale may be near 0
}

}  // namespace

TEST_CASE("upsampled motion is in HR pixels, and invalid where a tap of it is") {
    check_together([&] {
        check_motion_upsampling({19, 13}, 4, {0, 0});
        check_motion_upsampling({19, 13}, 3, {0, 0});  // the middle pixel of three has one tap
        check_motion_upsampling({9, 31}, 2, {0.21875f, -1.0f});
        check_motion_upsampling({9, 31}, 6, {-0.46875f, 0.40625f});
    });
}

TEST_CASE("a tap of hardly any weight does not make motion invalid") {
    constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
    for (const float weight : {0.0009f, 0.0011f}) {
        runtime::FrameConstants frame;
        frame.motion_jitter_x = -weight;  // pixel 1 of ×3 reads the next column with that weight
        const Planes motion = planes({2, 1, 2}, [&](int, int x, int) { return x ? kNan : 2.0f; });
        runtime::Problem problem;
        problem.node = {graph::UpsampleMotion{3}, {}, {2, 3, 6}, "motion upsampling"};
        problem.inputs = {pixel_layout(motion.shape, Storage::f32)};
        problem.output = pixel_layout({2, 3, 6}, Storage::f32);
        const auto& implementation = runtime::implementations(problem.node).back();
        const runtime::Choices choices = implementation.choices(problem, test_device().profile()).front();
        const Planes result = run_operator(problem, implementation, choices, {motion}, frame);
        CHECK(std::isnan(result.at(0, 1, 1)) == (weight > 0.001f));
        CHECK((weight > 0.001f || result.at(0, 1, 1) == doctest::Approx(6).epsilon(0.002)));
        CHECK(std::isnan(result.at(1, 2, 0)));
        CHECK(result.at(1, 0, 0) == doctest::Approx(6));
    }
}

TEST_CASE("upsample is bilinear around the jittered samples") {
    check_together([&] {
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
    });
}

TEST_SUITE("small") {
    TEST_CASE("upsample of small images") {
        check_together([&] {
            check_upsampling({3, 1, 1}, 2, graph::Shift::jitter, Storage::f32, {}, {2, 24, 6});
            check_upsampling({1, 5, 3}, 6, graph::Shift::motion_jitter, Storage::f16);
            check_motion_upsampling({1, 1}, 2, {0, 0});
            check_motion_upsampling({3, 2}, 5, {0.25f, -0.125f});
        });
    }
}
