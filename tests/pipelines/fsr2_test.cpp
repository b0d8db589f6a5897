#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "clarus/upscaler.h"
#include "film.h"
#include "operator_harness.h"
#include "test_device.h"

using namespace clarus;
using namespace clarus::test;
using runtime::Storage;

// docs/fsr2.md, pixel by pixel, in double precision.
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

Color ycocg(const Color& c) { return {(c[0] + 2 * c[1] + c[2]) / 4, (c[0] - c[2]) / 2, (2 * c[1] - c[0] - c[2]) / 4}; }

Color color_at(const Planes& image, int x, int y) {
    return ycocg({clamped(image, 0, x, y), clamped(image, 1, x, y), clamped(image, 2, x, y)});
}

Planes expected_residual(const Planes& color, const Planes& past, Vec2 jitter) {
    const double scale_x = double(past.shape.width) / color.shape.width;
    const double scale_y = double(past.shape.height) / color.shape.height;
    return planes(color.shape, [&](int c, int x, int y) {
        const double u = (x + 0.5 + jitter.x) * scale_x - 0.5, v = (y + 0.5 + jitter.y) * scale_y - 0.5;
        const int column = static_cast<int>(std::floor(u)), row = static_cast<int>(std::floor(v));
        double before = 0;
        for (int j = 0; j < 2; ++j)
            for (int i = 0; i < 2; ++i)
                before += (1 - std::abs(u - column - i)) * (1 - std::abs(v - row - j)) *
                          color_at(past, column + i, row + j)[c];
        return static_cast<float>(color_at(color, x, y)[c] - before);
    });
}

/// z of trust: of the window with radius r.
double doubt(const Planes& residual, int x, int y, int r, double deviations) {
    const double count = (2 * r + 1) * (2 * r + 1);
    double size = 0, variance = 0;
    for (int c = 0; c < 3; ++c) {
        double sum = 0, squares = 0;
        for (int j = -r; j <= r; ++j)
            for (int i = -r; i <= r; ++i) {
                const double value = clamped(residual, c, x + i, y + j);
                sum += value;
                squares += value * value;
            }
        size += sum / count * (sum / count);
        variance += std::max(squares / count - sum / count * (sum / count), 0.0);
    }
    return size / ((variance / count + 8e-5) * deviations * deviations);
}

bool is_valid(const Planes& motion, int x, int y) {
    return std::isfinite(clamped(motion, 0, x, y)) && std::isfinite(clamped(motion, 1, x, y));
}

Planes expected_trust(const Planes& residual, const Planes& motion, double scale) {
    return planes({1, residual.shape.height, residual.shape.width}, [&](int, int x, int y) {
        const bool valid = is_valid(motion, x, y);
        const double length = valid ? std::hypot(motion.at(0, x, y), motion.at(1, x, y)) : 0;
        const double still = std::max(0.0, 1 - 4 * scale * length);
        const double z = (1 - still) * doubt(residual, x, y, 1, 3) + still * doubt(residual, x, y, 2, 5);
        double span = 0;
        bool all_valid = true;
        for (int c = 0; c < 2; ++c) {
            double low = 1e30, high = -1e30;
            for (int j = y - 1; j <= y + 1; ++j)
                for (int i = x - 1; i <= x + 1; ++i) {
                    all_valid = all_valid && is_valid(motion, i, j);
                    low = std::min(low, double(clamped(motion, c, i, j)));
                    high = std::max(high, double(clamped(motion, c, i, j)));
                }
            span = std::max(span, high - low);
        }
        const double apart = all_valid ? std::clamp((span - 0.1 - 0.2 * length) / 0.4, 0.0, 1.0) : 1;
        return static_cast<float>((1 - 0.8 * apart) / (1 + z * z * z));
    });
}

std::array<double, 4> collected(const Planes& color, const Planes& past, const Planes& trust, const Planes& motion,
                                double scale, Vec2 jitter, int x, int y) {
    const double u = (x + 0.5) / scale - 0.5 - jitter.x, v = (y + 0.5) / scale - 0.5 - jitter.y;
    const int column = static_cast<int>(std::floor(std::clamp(u, 0.0, color.shape.width - 1.0) + 0.5 + 1.0 / 4096));
    const int row = static_cast<int>(std::floor(std::clamp(v, 0.0, color.shape.height - 1.0) + 0.5 + 1.0 / 4096));
    Color mean{}, square{}, fresh{}, first{}, shown;
    const double trusted = trust.at(0, column, row), share = 0.003 + 0.1 * (1 - trusted);
    double weight = 0, soft_weight = 0;
    for (int j = row - 1; j <= row + 1; ++j)
        for (int i = column - 1; i <= column + 1; ++i) {
            const Color sample = color_at(color, i, j);
            const double squared = (i - u) * (i - u) + (j - v) * (j - v);
            const double soft = std::exp2(-5 * squared), by = std::exp2(-3 * scale * scale * squared) + share * soft;
            for (int c = 0; c < 3; ++c) {
                mean[c] += sample[c] / 9;
                square[c] += sample[c] * sample[c] / 9;
                fresh[c] += by * sample[c];
                first[c] += soft * sample[c];
            }
            weight += by;
            soft_weight += soft;
        }
    if (past.at(3, x, y) > 0) {
        const double loose = 1 + 19 * trusted;
        const Color before = color_at(past, x, y);
        Color confined;
        double moved = 0, room = 1e-3;
        for (int c = 0; c < 3; ++c) {
            const double reach = loose * std::sqrt(std::max(square[c] - mean[c] * mean[c], 0.0));
            confined[c] = std::clamp(before[c], mean[c] - reach, mean[c] + reach);
            moved += (confined[c] - before[c]) * (confined[c] - before[c]);
            room += reach * reach;
        }
        const double speed = std::hypot(motion.at(0, x, y), motion.at(1, x, y));
        const double most = 12 - 11.4 * std::min(speed, 1.0);
        const double kept = std::min(trusted * past.at(3, x, y), most) * room / (room + moved);
        for (int c = 0; c < 3; ++c) shown[c] = (kept * confined[c] + fresh[c]) / (kept + weight);
        weight = std::min(kept + weight, 12.0);
    } else {
        for (int c = 0; c < 3; ++c) shown[c] = first[c] / soft_weight;
    }
    return {std::clamp(shown[0] + shown[1] - shown[2], 0.0, 1.0), std::clamp(shown[0] + shown[2], 0.0, 1.0),
            std::clamp(shown[0] - shown[1] - shown[2], 0.0, 1.0), weight};
}

struct Case {
    Size render;
    double scale;
    Vec2 jitter{0.3125f, -0.4375f};
    Storage storage = Storage::f32;
    int stride = 4, offset = 0;  // of colour

    graph::Shape render_shape(int channels) const { return {channels, render.height, render.width}; }
    graph::Shape output_shape(int channels) const {
        return {channels, static_cast<int>(std::lround(render.height * scale)),
                static_cast<int>(std::lround(render.width * scale))};
    }
    runtime::FrameConstants frame() const {
        runtime::FrameConstants frame;
        frame.jitter_x = jitter.x;
        frame.jitter_y = jitter.y;
        return frame;
    }
    float tolerance(float precise) const { return storage == Storage::f16 ? 4e-3f : precise; }
};

/// Colours, and weights: none, little or much.
Planes any_history(const Case& test, std::mt19937& random) {
    Planes history = random_planes(test.output_shape(4), random);
    for (int y = 0; y < history.shape.height; ++y)
        for (int x = 0; x < history.shape.width; ++x)
            history.at(3, x, y) *= random() % 4 == 0 ? 0.0f : random() % 4 == 0 ? 0.1f : 12.0f;
    return rounded(std::move(history), test.storage);
}

/// Surfaces that stand still, move and part, some of whose vectors are of no use.
Planes any_motion(graph::Shape shape, std::mt19937& random) {
    std::uniform_real_distribution<float> wide(-3, 3), narrow(-0.1f, 0.1f);
    float vector = 0;
    return planes(shape, [&](int, int, int) {
        const auto kind = random() % 64;
        if (kind == 0) return random() % 2 ? kNan : std::numeric_limits<float>::infinity();
        if (kind < 4) vector = random() % 2 ? 0 : wide(random);
        return kind < 40 ? vector : vector + narrow(random);
    });
}

void check_all(const Case& test) {
    CAPTURE(test.render.width);
    CAPTURE(test.render.height);
    CAPTURE(test.scale);
    CAPTURE(test.jitter.x);
    CAPTURE(static_cast<int>(test.storage));
    std::mt19937 random(31);
    const Planes past = any_history(test, random);
    const Planes color = rounded(random_planes(test.render_shape(3), random), test.storage);
    const auto color_layout = part_layout(color.shape, test.storage, 1, test.stride, test.offset);

    runtime::Problem problem;
    problem.node = {graph::Residual{}, {}, color.shape, "residual"};
    problem.inputs = {color_layout, pixel_layout(past.shape, test.storage)};
    problem.output = part_layout(color.shape, test.storage, 1, 4, 0);
    check_operator(problem, {color, past}, test.frame(), expected_residual(color, past, test.jitter),
                   test.tolerance(4e-6f));

    // In places the residuals are one shift of all, in others of either sign.
    Planes residual = random_planes(color.shape, random, -0.2f, 0.2f);
    for (int c = 0; c < 3; ++c)
        for (int y = 0; y < color.shape.height; ++y)
            for (int x = 0; x < color.shape.width; ++x) residual.at(c, x, y) += x % 16 < 8 ? 0 : 0.01f * (x % 8);
    residual = rounded(std::move(residual), test.storage);
    const Planes motion = any_motion(test.render_shape(2), random);
    problem.node = {graph::Trust{test.scale}, {}, test.render_shape(1), "trust"};
    problem.inputs = {part_layout(residual.shape, test.storage, 1, 4, 0),
                      part_layout(motion.shape, Storage::f32, 1, 4, 1)};
    problem.output = part_layout(problem.node.shape, test.storage, 1, 1, 0);
    check_operator(problem, {residual, motion}, test.frame(), expected_trust(residual, motion, test.scale),
                   test.tolerance(2e-5f));
    runtime::FrameConstants reset = test.frame();
    reset.reset = 1;
    const Planes nowhere = planes(motion.shape, [](int, int, int) { return kNan; });
    check_operator(problem, {residual, motion}, reset, expected_trust(residual, nowhere, test.scale),
                   test.tolerance(2e-5f));

    const Planes trust = rounded(random_planes(test.render_shape(1), random), test.storage);
    // Where a vector is of no use there is no history.
    const Planes followed = planes(test.output_shape(2), [&](int c, int x, int y) -> float {
        if (past.at(3, x, y) == 0) return kNan;
        return c == 0 ? static_cast<float>(x % 5) / 4 : static_cast<float>(y % 3) / 8;
    });
    Planes expected = past;
    for (int y = 0; y < past.shape.height; ++y)
        for (int x = 0; x < past.shape.width; ++x) {
            const auto pixel = collected(color, past, trust, followed, test.scale, test.jitter, x, y);
            for (int c = 0; c < 4; ++c) expected.at(c, x, y) = static_cast<float>(pixel[c]);
        }
    problem.node = {graph::Collect{test.scale}, {}, past.shape, "collect"};
    problem.inputs = {color_layout, pixel_layout(past.shape, test.storage),
                      part_layout(trust.shape, test.storage, 1, 1, 0),
                      part_layout(followed.shape, Storage::f32, 1, 4, 0)};
    problem.output = pixel_layout(past.shape, test.storage);
    check_operator(problem, {color, past, trust, followed}, test.frame(), expected, test.tolerance(2e-5f));
}

std::vector<double> psnr(const Film& film, int frames, std::vector<float>* last = nullptr) {
    return psnr_of(film, "fsr2", frames, last);
}

}  // namespace

TEST_CASE("fsr2's operators are what its definition says") {
    check_together([&] {
        for (const double scale : {1.0, 1.5, 2.0, 3.0})
            for (const Storage storage : {Storage::f32, Storage::f16})
                check_all({{37, 19}, scale, {0.3125f, -0.4375f}, storage, 20, 0});
        check_all({{67, 33}, 1.7, {-0.1875f, 0.0625f}});
        check_all({{150, 5}, 6, {0.4375f, -0.1875f}});
        check_all({{35, 22}, 1.3, {1.3125f, -1.4375f}});
    });
}

TEST_SUITE("small") {
    TEST_CASE("fsr2's operators on small images") {
        check_together([&] {
            for (const double scale : {1.0, 1.5, 2.0, 3.0}) {
                check_all({{1, 1}, scale});
                check_all({{5, 3}, scale, {-0.375f, 0.125f}, Storage::f32, 7, 4});
            }
            check_all({{1, 9}, 2, {0.5625f, -0.3125f}});
            check_all({{3, 2}, 2, {0.1875f, -0.3125f}, Storage::f16});
        });
    }
}

TEST_CASE("fsr2 converges to the reference on a still scene") {
    for (const auto& [scale, reached] : {std::pair{1.0, 34.0}, {1.5, 29.0}, {2.0, 27.0}, {3.0, 23.0}}) {
        CAPTURE(scale);
        Film film;
        film.scale = scale;
        const std::vector<double> found = psnr(film, 96);
        CHECK(found[15] > found[0] + 2);
        CHECK(found[95] > reached);
        CHECK(found[95] > psnr_of(film, "bicubic", 4).back() + 5);
    }
}

TEST_CASE("fsr2 follows a surface that moves") {
    Film film;
    film.motion = {-0.65f, 0.2f};
    film.shows = [](double x, double y, int t) { return scene(x + 2 * -0.65 * t + 40, y + 2 * 0.2 * t - 10); };
    const std::vector<double> found = psnr(film, 48), bicubic = psnr_of(film, "bicubic", 48);
    double gain = 0;
    for (int t = 16; t < 48; ++t) gain += (found[t] - bicubic[t]) / 32;
    CHECK(gain > 2);
}

TEST_CASE("fsr2 forgets what is no longer there") {
    Film film;
    constexpr int kCut = 32;  // without a reset
    film.shows = [](double x, double y, int t) {
        const Color color = scene(x, y);
        return t < kCut ? color : Color{color[2], 0.5 * color[0], 1 - color[1]};
    };
    const std::vector<double> found = psnr(film, kCut + 16);
    CHECK(found[kCut] > found[0] - 4);
    CHECK(found[kCut + 3] > found[0] - 0.5);
    CHECK(found[kCut + 15] > found[0] + 1);
}

TEST_CASE("fsr2 goes black with the frame") {
    Film film;
    film.shows = [](double x, double y, int t) { return t < 20 ? scene(x, y) : Color{0, 0, 0}; };
    std::vector<float> last;
    psnr(film, 21, &last);
    for (const float value : last) CHECK(value <= 2 / 255.0f);
}

TEST_CASE("a flat picture stays flat, whatever its vectors" * doctest::test_suite("small")) {
    for (const double scale : {1.0, 1.5, 2.0, 3.0})
        for (const Vec2 motion : {Vec2{0, 0}, Vec2{-1.3f, 0.4f}, Vec2{kNan, 0}}) {
            Film film;
            film.render = {13, 9};
            film.scale = scale;
            film.motion = motion;
            film.shows = [](double, double, int) { return Color{0.25, 0.5, 0.75}; };
            std::vector<float> last;
            psnr(film, 5, &last);
            for (size_t i = 0; i < last.size(); ++i)
                CHECK(last[i] == doctest::Approx(0.25 + 0.25 * static_cast<double>(i % 3)).epsilon(1e-5));
        }
}

TEST_CASE("fsr2 gives the same twice, and after no valid vector what it gives after a reset" *
          doctest::test_suite("small")) {
    Film film;
    film.motion = {0.5f, -0.25f};
    std::vector<float> once, again;
    psnr(film, 4, &once);
    psnr(film, 4, &again);
    CHECK(once == again);
    Film broken;
    broken.motion = {kNan, std::numeric_limits<float>::infinity()};
    broken.shows = [](double x, double y, int t) { return t == 2 ? scene(x, y) : Color{1, 0, 1}; };
    std::vector<float> third, alone;
    psnr(broken, 3, &third);
    broken.motion = {1e30f, 0};
    psnr(broken, 3, &alone);
    CHECK(third == alone);
    for (const float value : third) CHECK(std::isfinite(value));
}

TEST_CASE("fsr2 sharpens what it shows where it is told to" * doctest::test_suite("small")) {
    const Size size{12, 8};
    std::vector<float> color(3 * 12 * 8), depth(12 * 8, 0.5f), motion(2 * 12 * 8, 0.0f);
    for (size_t i = 0; i < color.size(); ++i) color[i] = static_cast<float>(i * 7 % 11) / 11;
    const auto shown = [&](std::map<std::string, double> pipeline_options) {
        UpscalerOptions options;
        options.pipeline_options = std::move(pipeline_options);
        Upscaler upscaler(test_device(), Model::filter("fsr2", 2), size, options);
        std::vector<float> output(4 * color.size());
        FrameDescription frame;
        frame.color = {.host = color.data(), .size = size};
        frame.depth = {.host = depth.data(), .size = size};
        frame.motion = {.host = motion.data(), .size = size};
        frame.output = {.host = output.data(), .size = upscaler.output_size()};
        upscaler.submit(frame).wait();
        return output;
    };
    CHECK(shown({}) == shown({{"sharpness", 0}}));
    CHECK(shown({}) != shown({{"sharpness", 0.5}}));
}
