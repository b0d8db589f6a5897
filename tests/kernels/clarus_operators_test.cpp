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

// docs/clarus.md, pixel by pixel, in double precision.
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

float clamped(const Planes& image, int c, int x, int y) {
    return image.at(c, std::clamp(x, 0, image.shape.width - 1), std::clamp(y, 0, image.shape.height - 1));
}

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

Planes expected_senses(const Planes& past, const Planes& depth, Vec2 jitter) {
    const graph::Shape& shape = depth.shape;
    const double scale_x = double(past.shape.width) / shape.width, scale_y = double(past.shape.height) / shape.height;
    const auto look_up = [&](int c, int x, int y, double dx, double dy) {
        return bilinear(past, c, (x + 0.5 + dx) * scale_x - 0.5, (y + 0.5 + dy) * scale_y - 0.5);
    };
    return planes({graph::kSensed, shape.height, shape.width}, [&](int c, int x, int y) {
        if (c < 3) return static_cast<float>(look_up(c, x, y, jitter.x, jitter.y));
        if (c == 3) return static_cast<float>(std::log2(1 + look_up(3, x, y, jitter.x, jitter.y)) / 4);
        if (c < 8) {
            const double dx = c % 2 == 0 ? -0.25 : 0.25, dy = c < 6 ? -0.25 : 0.25;
            return static_cast<float>(0.299 * look_up(0, x, y, dx, dy) + 0.587 * look_up(1, x, y, dx, dy) +
                                      0.114 * look_up(2, x, y, dx, dy));
        }
        float nearest = depth.at(0, x, y);
        for (int j = -1; j <= 1; ++j)
            for (int i = -1; i <= 1; ++i) nearest = std::min(nearest, clamped(depth, 0, x + i, y + j));
        return static_cast<float>(1 - nearest / std::max(double(depth.at(0, x, y)), 1e-6));
    });
}

double sigmoid(double v) { return 1 / (1 + std::exp(-v)); }

struct Composed {
    std::array<float, 4> pixel{};
    int column = 0, row = 0;  // of the nearest sample
    double cancellation = 0;  // what the terms of the weights add up to without their signs, over what they do
};

Composed expected_pixel(const Planes& color, const Planes& past, const Planes& parameters, double scale, Vec2 jitter,
                        int x, int y) {
    const double u = (x + 0.5) / scale - 0.5 - jitter.x, v = (y + 0.5) / scale - 0.5 - jitter.y;
    const graph::Shape& shape = color.shape;
    const int column = static_cast<int>(std::floor(std::clamp(u, 0.0, shape.width - 1.0) + 0.5 + 1.0 / 4096));
    const int row = static_cast<int>(std::floor(std::clamp(v, 0.0, shape.height - 1.0) + 0.5 + 1.0 / 4096));
    const double dx = u - column, dy = v - row;
    const auto p = [&](int c) -> double { return parameters.at(c, column, row); };
    const double a = 2 * std::exp2(std::clamp(p(0), -6.0, 6.0)), b = 2 * std::exp2(std::clamp(p(1), -6.0, 6.0));
    const double e = 0.95 * std::tanh(p(2)) * std::sqrt(a * b), lobe = sigmoid(p(3)) / 2;
    double sum[3]{}, norm = 0, size = 0, low[3], high[3];
    std::fill(low, low + 3, 1e9);
    std::fill(high, high + 3, -1e9);
    for (int j = -1; j <= 1; ++j)
        for (int i = -1; i <= 1; ++i) {
            const double fx = i - dx, fy = j - dy, r = (a * fx * fx + b * fy * fy) / 2 + e * fx * fy;
            const double weight = std::exp(-r) * (1 - lobe * r);
            norm += weight;
            size += std::exp(-r) * (1 + lobe * r);
            for (int c = 0; c < 3; ++c) {
                const double sample = clamped(color, c, column + i, row + j);
                sum[c] += weight * sample;
                low[c] = std::min(low[c], sample);
                high[c] = std::max(high[c], sample);
            }
        }
    const double nearness = std::exp(-scale * scale * (dx * dx + dy * dy) / (2 * 0.45 * 0.45));
    const double fresh = std::exp2(std::clamp(p(4), -6.0, 4.0)) * nearness + std::exp2(std::clamp(p(5), -8.0, 4.0));
    const double kept = sigmoid(p(6)) * past.at(3, x, y);
    Composed result{{}, column, row, size / std::max(norm, 1e-3)};
    for (int c = 0; c < 3; ++c) {
        const double free = sum[c] / std::max(norm, 1e-3) + p(8 + c) + dx * p(11 + c) + dy * p(14 + c);
        const double estimate = std::clamp(free, low[c], high[c]), history = past.at(c, x, y);
        const double held = std::clamp(history, low[c], high[c]);
        const double before = held + sigmoid(p(7)) * (history - held);
        result.pixel[c] = static_cast<float>((kept * before + fresh * estimate) / (kept + fresh));
    }
    result.pixel[3] = static_cast<float>(std::min(kept + fresh, 64.0));
    return result;
}

Planes expected_composition(const Planes& color, const Planes& past, const Planes& parameters, double scale,
                            Vec2 jitter) {
    Planes result = past;
    for (int y = 0; y < past.shape.height; ++y)
        for (int x = 0; x < past.shape.width; ++x) {
            const auto pixel = expected_pixel(color, past, parameters, scale, jitter, x, y).pixel;
            for (int c = 0; c < 4; ++c) result.at(c, x, y) = pixel[c];
        }
    return result;
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

void check_sense(const Case& test) {
    CAPTURE_CASE(test);
    std::mt19937 random(22);
    const Planes past = any_history(test, random);
    Planes depth = random_planes(test.render_shape(1), random);
    for (float& value : depth.values)
        if (random() % 8 == 0) value = random() % 2 ? 0 : 1;
    runtime::Problem problem;
    problem.node = {graph::Sense{}, {}, test.render_shape(graph::kSensed), "sense"};
    problem.inputs = {pixel_layout(past.shape, test.storage), part_layout(depth.shape, Storage::f32, 1, 4, 0)};
    problem.output = part_layout(problem.node.shape, test.storage, 1, 20, 3);
    // A division by 10⁻⁶ makes large numbers of small ones.
    check_operator(problem, {past, depth}, test.frame(), expected_senses(past, depth, test.jitter),
                   test.tolerance(4e-6f));
}

/// Parameters over their ranges and beyond.
Planes any_parameters(const Case& test, std::mt19937& random) {
    std::uniform_real_distribution<float> wide(-9, 7), near(-0.3f, 0.3f);
    return rounded(planes(test.render_shape(graph::kComposeParameters),
                          [&](int c, int, int) {
                              const float far = c < 8 ? 200.0f : 2.0f;
                              if (random() % 50 == 0) return random() % 2 ? far : -far;
                              return c < 8 ? wide(random) : near(random);
                          }),
                   test.storage);
}

/// Where taps nearly cancel out, what is left of them is rounding errors: there, none is negative.
void avoid_cancellation(const Case& test, const Planes& color, const Planes& past, Planes& parameters) {
    for (int y = 0; y < past.shape.height; ++y)
        for (int x = 0; x < past.shape.width; ++x) {
            const Composed composed = expected_pixel(color, past, parameters, test.scale, test.jitter, x, y);
            if (composed.cancellation > 3) parameters.at(3, composed.column, composed.row) = -9;
        }
}

void check_compose(const Case& test) {
    CAPTURE_CASE(test);
    std::mt19937 random(23);
    const Planes past = any_history(test, random);
    const Planes color = rounded(random_planes(test.render_shape(3), random), test.storage);
    Planes parameters = any_parameters(test, random);
    avoid_cancellation(test, color, past, parameters);
    runtime::Problem problem;
    problem.node = {graph::Compose{test.scale}, {}, past.shape, "compose"};
    problem.inputs = {part_layout(color.shape, test.storage, 1, test.stride, test.offset),
                      pixel_layout(past.shape, test.storage), part_layout(parameters.shape, test.storage, 1, 24, 0)};
    problem.output = pixel_layout(past.shape, test.storage);
    // Of a tap the exponent is r, a sum of squares of up to some hundreds.
    check_operator(problem, {color, past, parameters}, test.frame(),
                   expected_composition(color, past, parameters, test.scale, test.jitter), test.tolerance(2e-5f));
}

void check_all(const std::vector<Case>& cases) {
    check_together([&] {
        for (const Case& test : cases) {
            check_warp(test);
            check_sense(test);
            check_compose(test);
        }
    });
}

const double kScales[] = {1, 1.3, 1.5, 2, 3, 4};

}  // namespace

TEST_CASE("Clarus' operators agree with their definition at every scale") {
    for (const double scale : kScales)
        check_all({{{37, 19}, scale, {0.3125f, -0.4375f}, Storage::f32, 20, 0},
                   {{37, 19}, scale, {0.3125f, -0.4375f}, Storage::f16, 20, 0}});
    check_all({{{67, 33}, 1.7, {-0.1875f, 0.0625f}},
               // Nearest samples' ties.
               {{35, 22}, 2, {0.25f, -0.25f}},
               {{35, 22}, 1.5, {0, 0.5f}}});
}

TEST_CASE("Clarus' operators bear a jitter of more than a pixel") {
    std::vector<Case> cases;
    for (const double scale : kScales) cases.push_back({{21, 40}, scale, {2.3125f, -3.1875f}});
    check_all(cases);
}

TEST_CASE("a far pixel is as accurate as a near one") {
    check_sense({{5000, 2}, 1.3});
    check_compose({{5000, 2}, 1.3});
}

TEST_SUITE("small") {
    TEST_CASE("Clarus' operators on small images") {
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
