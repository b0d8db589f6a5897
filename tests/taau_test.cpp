#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "film.h"
#include "filter_kernels.h"
#include "operator_harness.h"

using namespace clarus;
using namespace clarus::test;
using runtime::Storage;

namespace {

Planes expected_foremost(const Planes& motion, const Planes& depth) {
    return planes(motion.shape, [&](int c, int x, int y) {
        int foremost_x = x, foremost_y = y;
        for (int row = y - 1; row <= y + 1; ++row) {
            for (int column = x - 1; column <= x + 1; ++column) {
                const bool inside = column >= 0 && column < depth.shape.width && row >= 0 && row < depth.shape.height;
                if (inside && depth.at(0, column, row) < depth.at(0, foremost_x, foremost_y)) {
                    foremost_x = column;
                    foremost_y = row;
                }
            }
        }
        return motion.at(c, foremost_x, foremost_y);
    });
}

void check_foremost(int width, int height, Storage storage) {
    std::mt19937 random(6);
    Planes motion = random_planes({2, height, width}, random, -4, 4);
    Planes depth = random_planes({1, height, width}, random);
    for (float& value : depth.values) value = std::floor(8 * value) / 8;  // ties
    motion.values[0] = NAN;
    runtime::Problem problem;
    problem.node = {graph::ForemostMotion{}, {}, motion.shape, "foremost motion"};
    problem.inputs = {part_layout(motion.shape, Storage::f32, 1, 4, 1), part_layout(depth.shape, storage, 1, 3, 0)};
    problem.output = pixel_layout(motion.shape, Storage::f32);
    check_operator(problem, {motion, depth}, {}, expected_foremost(motion, depth), 0);
}

Color ycocg(const Color& c) {
    return {0.25 * c[0] + 0.5 * c[1] + 0.25 * c[2], 0.5 * c[0] - 0.5 * c[2], -0.25 * c[0] + 0.5 * c[1] - 0.25 * c[2]};
}

Color rgb(const Color& c) { return {c[0] + c[1] - c[2], c[0] + c[2], c[0] - c[1] - c[2]}; }

/// An image around index coordinates, filtered by a kernel of that radius, border clamp.
double filtered(const Planes& image, int c, double u, double v, double (*kernel)(double), int radius) {
    double sum = 0;
    for (int j = 1 - radius; j <= radius; ++j) {
        for (int i = 1 - radius; i <= radius; ++i) {
            const double column = std::floor(u) + i, row = std::floor(v) + j;
            sum += kernel(u - column) * kernel(v - row) *
                   image.at(c, static_cast<int>(std::clamp(column, 0.0, image.shape.width - 1.0)),
                            static_cast<int>(std::clamp(row, 0.0, image.shape.height - 1.0)));
        }
    }
    return sum;
}

/// A pixel as the definition in pipelines/filters/README.md has it.
std::array<double, 5> accumulated(int x, int y, double scale, const Planes& color, const Planes& motion,
                                  const Planes& history, const runtime::FrameConstants& frame) {
    const double u = (x + 0.5) / scale - 0.5 - frame.jitter_x, v = (y + 0.5) / scale - 0.5 - frame.jitter_y;
    const int column = static_cast<int>(std::floor(u + 0.5)), row = static_cast<int>(std::floor(v + 0.5));
    Color mean{}, square{}, sharp{}, soft{};
    double sharp_weight = 0, soft_weight = 0;
    for (int j = row - 1; j <= row + 1; ++j) {
        for (int i = column - 1; i <= column + 1; ++i) {
            const int sample_x = std::clamp(i, 0, color.shape.width - 1),
                      sample_y = std::clamp(j, 0, color.shape.height - 1);
            const Color sample = ycocg(
                {color.at(0, sample_x, sample_y), color.at(1, sample_x, sample_y), color.at(2, sample_x, sample_y)});
            const double squared = (i - u) * (i - u) + (j - v) * (j - v);
            const double near = std::exp2(-8 * squared * scale * scale), wide = std::exp2(-2.885 * squared);
            for (int c = 0; c < 3; ++c) {
                mean[c] += sample[c] / 9;
                square[c] += sample[c] * sample[c] / 9;
                sharp[c] += near * sample[c];
                soft[c] += wide * sample[c];
            }
            sharp_weight += near;
            soft_weight += wide;
        }
    }
    const int vector_x =
        std::clamp(static_cast<int>(std::floor((x + 0.5) / scale - frame.motion_jitter_x)), 0, motion.shape.width - 1);
    const int vector_y =
        std::clamp(static_cast<int>(std::floor((y + 0.5) / scale - frame.motion_jitter_y)), 0, motion.shape.height - 1);
    const double from_x = x + scale * motion.at(0, vector_x, vector_y);
    const double from_y = y + scale * motion.at(1, vector_x, vector_y);
    double weight = sharp_weight + 0.003 * soft_weight, variance = 0;
    Color result;
    if (!frame.reset && from_x >= -0.5 && from_x <= history.shape.width - 0.5 && from_y >= -0.5 &&
        from_y <= history.shape.height - 0.5) {
        Color before;
        for (int c = 0; c < 3; ++c) before[c] = filtered(history, c, from_x, from_y, keys, 2);
        before = ycocg(before);
        const auto triangle = [](double d) { return std::max(0.0, 1 - std::abs(d)); };
        const double known = filtered(history, 3, from_x, from_y, triangle, 1);
        const double varied = filtered(history, 4, from_x, from_y, triangle, 1);
        Color confined, change;
        double excess = 0, reach_squared = 0, change_squared = 0;
        for (int c = 0; c < 3; ++c) {
            const double deviation = std::sqrt(std::max(square[c] - mean[c] * mean[c], 0.0));
            const double reach = std::max(1.5 * deviation, std::sqrt(varied));
            confined[c] = std::clamp(before[c], mean[c] - reach, mean[c] + reach);
            change[c] = (sharp[c] + 0.003 * soft[c]) / weight - confined[c];
            excess += (confined[c] - before[c]) * (confined[c] - before[c]);
            reach_squared += reach * reach;
            change_squared += change[c] * change[c];
        }
        const double believed = known / (1 + excess / (0.001 + reach_squared)), share = weight / (believed + weight);
        for (int c = 0; c < 3; ++c) result[c] = confined[c] + share * change[c];
        variance = (1 - share) * (varied + share * change_squared);
        weight = std::min(believed + weight, 12.0);
    } else {
        for (int c = 0; c < 3; ++c) result[c] = soft[c] / soft_weight;
    }
    result = rgb(result);
    return {std::clamp(result[0], 0.0, 1.0), std::clamp(result[1], 0.0, 1.0), std::clamp(result[2], 0.0, 1.0), weight,
            variance};
}

void check_accumulation(Size render, double scale, Storage storage, bool reset = false) {
    CAPTURE(scale);
    std::mt19937 random(4);
    const Size size{static_cast<int>(std::lround(render.width * scale)),
                    static_cast<int>(std::lround(render.height * scale))};
    const Planes color = rounded(random_planes({3, render.height, render.width}, random), storage);
    Planes motion = random_planes({2, render.height, render.width}, random, -3, 3);
    for (size_t i = 0; i < motion.values.size(); i += 7) motion.values[i] = 0;
    for (size_t i = 0; i < motion.values.size(); i += 23) motion.values[i] = NAN;
    for (size_t i = 5; i < motion.values.size(); i += 41) motion.values[i] = -1e6f;
    Planes history = random_planes({graph::kAccumulated, size.height, size.width}, random);
    for (int y = 0; y < size.height; ++y) {
        for (int x = 0; x < size.width; ++x) {
            history.at(3, x, y) *= 12;
            history.at(4, x, y) *= 0.05f;
        }
    }
    history = rounded(history, storage);
    runtime::FrameConstants frame;
    frame.jitter_x = 0.34375f;
    frame.jitter_y = -0.40625f;
    frame.motion_jitter_x = 0.28125f;
    frame.motion_jitter_y = -0.21875f;
    frame.reset = reset;
    Planes expected = history;
    for (int y = 0; y < size.height; ++y) {
        for (int x = 0; x < size.width; ++x) {
            const auto pixel = accumulated(x, y, scale, color, motion, history, frame);
            for (int c = 0; c < graph::kAccumulated; ++c) expected.at(c, x, y) = static_cast<float>(pixel[c]);
        }
    }
    runtime::Problem problem;
    problem.node = {graph::Accumulate{scale}, {}, expected.shape, "accumulate"};
    problem.inputs = {part_layout(color.shape, storage, 1, 4, 0), pixel_layout(motion.shape, Storage::f32),
                      part_layout(history.shape, storage, 1, 8, 0)};
    problem.output = part_layout(expected.shape, storage, 1, 8, 0);
    // Places some hundred pixels away are rounded to 3e-5 pixels, between weights up to 12.
    check_operator(problem, {color, motion, history}, frame, expected, storage == Storage::f16 ? 2e-2f : 2e-4f);
}

}  // namespace

TEST_CASE("a pixel has the motion of what is in front around it") {
    check_foremost(37, 22, Storage::f32);
    check_foremost(16, 9, Storage::f16);
}

TEST_CASE("accumulation is what its definition says") {
    for (const Storage storage : {Storage::f32, Storage::f16}) {
        check_accumulation({37, 22}, 2, storage);
        check_accumulation({41, 19}, 1.5, storage);
    }
    check_accumulation({33, 18}, 1, Storage::f32);
    check_accumulation({400, 3}, 1.7, Storage::f32);
    check_accumulation({11, 9}, 6, Storage::f32);
    check_accumulation({7, 4}, 23.7, Storage::f32);
    check_accumulation({16, 9}, 2, Storage::f32, true);
}

TEST_SUITE("small") {
    TEST_CASE("accumulation of small images") {
        check_foremost(1, 1, Storage::f32);
        check_foremost(2, 5, Storage::f16);
        check_accumulation({1, 1}, 2, Storage::f32);
        check_accumulation({3, 5}, 1.3, Storage::f32);
    }
}

TEST_CASE("taau converges to the reference on a still scene") {
    // At ×3 fewer than four of the jitter's 32 samples fall into a pixel.
    for (const auto& [scale, reached] : {std::pair{1.0, 43.0}, {1.5, 33.5}, {2.0, 30.0}, {3.0, 25.0}}) {
        CAPTURE(scale);
        Film film;
        film.scale = scale;
        const std::vector<double> psnr = psnr_of(film, "taau", 128);
        const double bicubic = psnr_of(film, "bicubic", 4).back();
        CHECK(psnr[15] > psnr[0] + 2);
        CHECK(psnr[127] > psnr[15] - 0.5);
        CHECK(psnr[127] > reached);
        CHECK(psnr[127] > bicubic + 10);
    }
}

TEST_CASE("taau follows a surface that moves") {
    Film film;
    film.motion = {-0.65f, 0.2f};
    film.shows = [](double x, double y, int t) { return scene(x + 2 * -0.65 * t + 40, y + 2 * 0.2 * t - 10); };
    const std::vector<double> psnr = psnr_of(film, "taau", 48), bicubic = psnr_of(film, "bicubic", 48);
    double gain = 0;
    for (int t = 16; t < 48; ++t) gain += (psnr[t] - bicubic[t]) / 32;
    CHECK(gain > 2);
}

TEST_CASE("taau forgets what is no longer there") {
    Film film;
    constexpr int kCut = 32;  // without a reset
    film.shows = [](double x, double y, int t) {
        const Color color = scene(x, y);
        return t < kCut ? color : Color{color[2], 0.5 * color[0], 1 - color[1]};
    };
    const std::vector<double> psnr = psnr_of(film, "taau", kCut + 16);
    CHECK(psnr[kCut] > psnr[0] - 4);
    CHECK(psnr[kCut + 3] > psnr[0]);
    CHECK(psnr[kCut + 15] > psnr[0] + 1);
}

TEST_CASE("taau without one valid vector is as after a reset") {
    Film still;
    std::vector<float> first, lost;
    Film once = still;
    once.shows = [](double x, double y, int) { return scene(x, y); };
    psnr_of(once, "taau", 1, &first);
    Film broken = still;
    broken.motion = {NAN, INFINITY};
    psnr_of(broken, "taau", 1, &lost);
    CHECK(lost == first);
    broken.shows = [](double x, double y, int t) { return t == 2 ? scene(x, y) : Color{1, 0, 1}; };
    std::vector<float> third;
    psnr_of(broken, "taau", 3, &third);
    Film alone = broken;
    alone.motion = {1e30f, 0};
    std::vector<float> same;
    psnr_of(alone, "taau", 3, &same);
    CHECK(third == same);
    for (const float value : third) CHECK(std::isfinite(value));
}
