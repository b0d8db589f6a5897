#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "operator_harness.h"

using namespace clarus;
using namespace clarus::test;
using runtime::Storage;

// docs/fsr2.md, "warp_sharply(image, M)", pixel by pixel, in double precision.
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

double bilinear(const Planes& image, int c, double u, double v) {
    const double left = std::floor(u), top = std::floor(v), right = u - left, below = v - top;
    const int x = static_cast<int>(left), y = static_cast<int>(top);
    return (1 - right) * (1 - below) * clamped(image, c, x, y) + right * (1 - below) * clamped(image, c, x + 1, y) +
           (1 - right) * below * clamped(image, c, x, y + 1) + right * below * clamped(image, c, x + 1, y + 1);
}

/// Catmull and Rom's cubic.
double cubic(double distance) {
    const double x = std::abs(distance);
    if (x <= 1) return 1.5 * x * x * x - 2.5 * x * x + 1;
    return x < 2 ? -0.5 * x * x * x + 2.5 * x * x - 4 * x + 2 : 0;
}

double sharp(const Planes& image, int c, double u, double v) {
    const int column = static_cast<int>(std::floor(u)), row = static_cast<int>(std::floor(v));
    double sum = 0, norm = 0;
    for (int y = row - 1; y <= row + 2; ++y)
        for (int x = column - 1; x <= column + 2; ++x) {
            const bool corner = (x == column - 1 || x == column + 2) && (y == row - 1 || y == row + 2);
            if (corner) continue;
            const double weight = cubic(u - x) * cubic(v - y);
            sum += weight * clamped(image, c, x, y);
            norm += weight;
        }
    return std::clamp(sum / norm, 0.0, 1.0);
}

Planes expected_warp(const Planes& history, const Planes& motion, const Planes& color, double scale, Vec2 jitter,
                     bool reset) {
    return planes(history.shape, [&](int c, int x, int y) -> float {
        const double dx = motion.at(0, x, y), dy = motion.at(1, x, y);
        if (!reset && std::isfinite(dx) && std::isfinite(dy)) {
            // Far outside there is nothing new.
            const double u = std::clamp(x + dx, -1e6, 1e6), v = std::clamp(y + dy, -1e6, 1e6);
            return static_cast<float>(c < 3 ? sharp(history, c, u, v) : bilinear(history, c, u, v));
        }
        if (c == 3) return 0;
        return static_cast<float>(
            bilinear(color, c, (x + 0.5) / scale - 0.5 - jitter.x, (y + 0.5) / scale - 0.5 - jitter.y));
    });
}

struct Case {
    Size render;
    double scale;
    Vec2 jitter{0.3125f, -0.4375f};
    Storage storage = Storage::f32;
    int stride = 4, offset = 0;  // of colour
    bool reset = false;

    Size output() const {
        return {static_cast<int>(std::lround(render.width * scale)),
                static_cast<int>(std::lround(render.height * scale))};
    }
    graph::Shape render_shape(int channels) const { return {channels, render.height, render.width}; }
    graph::Shape output_shape(int channels) const { return {channels, output().height, output().width}; }
    runtime::FrameConstants frame() const {
        runtime::FrameConstants frame;
        frame.jitter_x = jitter.x;
        frame.jitter_y = jitter.y;
        frame.reset = reset;
        return frame;
    }
    /// What storing rounds away of values up to `largest`.
    float tolerance(float precise) const { return storage == Storage::f16 ? 1e-3f : precise; }
};

#define CAPTURE_CASE(test)         \
    CAPTURE((test).render.width);  \
    CAPTURE((test).render.height); \
    CAPTURE((test).scale);         \
    CAPTURE((test).jitter.x);      \
    CAPTURE(static_cast<int>((test).storage))

/// Colour, and weights up to the most.
Planes any_history(const Case& test, std::mt19937& random) {
    Planes history = random_planes(test.output_shape(4), random);
    std::uniform_real_distribution<float> exponents(-8, 6);
    for (int y = 0; y < history.shape.height; ++y)
        for (int x = 0; x < history.shape.width; ++x)
            history.at(3, x, y) = random() % 5 == 0 ? 0 : std::exp2(exponents(random));
    return rounded(std::move(history), test.storage);
}

float any_motion(std::mt19937& random, int size) {
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    switch (random() % 16) {
        case 0:
            return kNan;
        case 1:
            return random() % 2 ? kInfinity : -kInfinity;
        case 2:
            return random() % 2 ? 1e30f : -3e9f;
        case 3:
            return std::uniform_real_distribution(-1.5f, 1.5f)(random) * static_cast<float>(size);
        case 4:
        case 5:
            return static_cast<float>(std::uniform_int_distribution(-3, 3)(random));
        case 6:
            return -1e-9f;
        default:
            return std::uniform_real_distribution(-3.0f, 3.0f)(random);
    }
}

void check_warp(const Case& test) {
    CAPTURE_CASE(test);
    std::mt19937 random(21);
    const Planes history = any_history(test, random);
    const Planes color = rounded(random_planes(test.render_shape(3), random), test.storage);
    const Planes motion = planes(test.output_shape(2), [&](int c, int, int) {
        return any_motion(random, c == 0 ? test.output().width : test.output().height);
    });
    runtime::Problem problem;
    problem.node = {graph::WarpSharply{test.scale}, {}, history.shape, "warp sharply"};
    problem.inputs = {pixel_layout(history.shape, test.storage), part_layout(motion.shape, Storage::f32, 1, 4, 0),
                      part_layout(color.shape, test.storage, 1, test.stride, test.offset)};
    problem.output = pixel_layout(history.shape, test.storage);
    check_operator(problem, {history, motion, color}, test.frame(),
                   expected_warp(history, motion, color, test.scale, test.jitter, test.reset), test.tolerance(4e-6f));
}

void check_all(const std::vector<Case>& cases) {
    check_together([&] {
        for (const Case& test : cases) {
            check_warp(test);
        }
    });
}

const double kScales[] = {1, 1.3, 1.5, 2, 3, 4};

}  // namespace

TEST_CASE("a sharp warp agrees with its definition at every scale") {
    for (const double scale : kScales)
        check_all({{{37, 19}, scale, {0.3125f, -0.4375f}, Storage::f32, 20, 0},
                   {{37, 19}, scale, {0.3125f, -0.4375f}, Storage::f16, 20, 0}});
    check_all({{{67, 33}, 1.7, {-0.1875f, 0.0625f}},
               // Nearest samples' ties.
               {{35, 22}, 2, {0.25f, -0.25f}},
               {{35, 22}, 1.5, {0, 0.5f}}});
}

TEST_CASE("a sharp warp bears a jitter of more than a pixel") {
    std::vector<Case> cases;
    for (const double scale : kScales) cases.push_back({{21, 40}, scale, {2.3125f, -3.1875f}});
    check_all(cases);
}

TEST_SUITE("small") {
    TEST_CASE("a sharp warp of small images") {
        for (const double scale : kScales)
            check_all({{{1, 1}, scale}, {{5, 3}, scale, {-0.375f, 0.125f}, Storage::f32, 7, 4}});
        check_all({{{1, 9}, 2, {1.5f, -1.25f}}, {{3, 2}, 2, {0.25f, -0.25f}, Storage::f16}});
    }

    TEST_CASE("a reset frame has the colour for its past, of no weight") {
        Case test{{5, 4}, 1.5};
        test.reset = true;
        check_warp(test);
    }
}
