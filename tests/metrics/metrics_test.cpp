#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "clarus/error.h"
#include "metrics/display.h"
#include "metrics/if_ssim.h"
#include "metrics/pixel_std.h"
#include "metrics/psnr.h"
#include "metrics/quality.h"
#include "metrics/ssim.h"

using clarus::ColorSpace;
using clarus::Size;
using clarus::io::Pixels;
namespace metrics = clarus::metrics;

namespace {

Pixels constant(Size size, float value) {
    return {size, 3, std::vector<float>(static_cast<size_t>(size.width) * size.height * 3, value)};
}

Pixels noise(Size size, unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> distribution(0, 1);
    Pixels pixels = constant(size, 0);
    for (float& value : pixels.values) value = distribution(random);
    return pixels;
}

// The definition: a two-dimensional window, central moments, nothing shared between windows.
double plain_ssim(const Pixels& x, const Pixels& y) {
    double weights[11][11], weight_sum = 0;
    for (int j = 0; j < 11; ++j)
        for (int i = 0; i < 11; ++i)
            weight_sum += weights[j][i] = std::exp(-((i - 5) * (i - 5) + (j - 5) * (j - 5)) / (2 * 1.5 * 1.5));

    double total = 0;
    int windows = 0;
    for (int channel = 0; channel < 3; ++channel) {
        for (int top = 0; top + 11 <= x.size.height; ++top) {
            for (int left = 0; left + 11 <= x.size.width; ++left) {
                const auto mean = [&](auto&& value) {
                    double sum = 0;
                    for (int j = 0; j < 11; ++j)
                        for (int i = 0; i < 11; ++i) sum += weights[j][i] / weight_sum * value(left + i, top + j);
                    return sum;
                };
                const double mx = mean([&](int i, int j) { return x.at(i, j, channel); });
                const double my = mean([&](int i, int j) { return y.at(i, j, channel); });
                const double vx = mean([&](int i, int j) { return std::pow(x.at(i, j, channel) - mx, 2); });
                const double vy = mean([&](int i, int j) { return std::pow(y.at(i, j, channel) - my, 2); });
                const double covariance =
                    mean([&](int i, int j) { return (x.at(i, j, channel) - mx) * (y.at(i, j, channel) - my); });
                total +=
                    (2 * mx * my + 1e-4) * (2 * covariance + 9e-4) / ((mx * mx + my * my + 1e-4) * (vx + vy + 9e-4));
                ++windows;
            }
        }
    }
    return total / windows;
}

Pixels filled(Size size, int channels, float value) {
    return {size, channels, std::vector<float>(static_cast<size_t>(size.width) * size.height * channels, value)};
}

// A pair of consecutive frames whose motion, depth and reference are given as constants, to be disturbed pixel by
// pixel.
struct Pair {
    explicit Pair(Size size, float level = 100 / 255.0f)
        : previous(constant(size, level)),
          reference(constant(size, level)),
          previous_depth(filled(size, 1, 0.5f)),
          truth{filled(size, 1, 0.5f), filled(size, 2, 0)} {}

    metrics::InterFrame inter_frame() const { return {previous, previous_depth, reference, truth}; }
    std::vector<uint8_t> mask() const { return inter_frame().mask(); }

    Pixels previous, reference, previous_depth;
    clarus::io::GroundTruth truth;
};

using Mask = std::vector<uint8_t>;

// docs/metrics.md, "Whole frames", IF-SSIM, step by step and in double.
double plain_if_ssim(const Pair& pair, const Pixels& before, const Pixels& after) {
    const auto [width, height] = before.size;
    const auto sample = [&](const Pixels& image, double x, double y, int c) {
        const double i = std::floor(x), j = std::floor(y);
        double sum = 0;
        for (int dy = 0; dy < 2; ++dy)
            for (int dx = 0; dx < 2; ++dx) {
                const double weight = (dx ? x - i : 1 - (x - i)) * (dy ? y - j : 1 - (y - j));
                sum += weight * image.at(static_cast<int>(std::clamp(i + dx, 0.0, width - 1.0)),
                                         static_cast<int>(std::clamp(j + dy, 0.0, height - 1.0)), c);
            }
        return sum;
    };
    const auto warped = [&](const Pixels& image, int x, int y, int c) {
        return sample(image, x + pair.truth.motion.at(x, y, 0), y + pair.truth.motion.at(x, y, 1), c);
    };
    const auto threshold = [](double b) {
        const double at[] = {0, 32, 64, 128, 192, 255}, f[] = {6, 8, 10, 14, 18, 22};
        int i = 0;
        while (i < 4 && b > at[i + 1]) ++i;
        return f[i] + (f[i + 1] - f[i]) * (b - at[i]) / (at[i + 1] - at[i]);
    };
    const auto passes = [&](int x, int y) {
        if (std::abs(warped(pair.previous_depth, x, y, 0) - pair.truth.depth.at(x, y, 0)) >= 0.01) return false;
        double brightness = 0, difference = 0;
        for (int c = 0; c < 3; ++c) {
            for (int j = -2; j <= 2; ++j)
                for (int i = -2; i <= 2; ++i)
                    brightness +=
                        255.0 / 75 *
                        pair.reference.at(std::clamp(x + i, 0, width - 1), std::clamp(y + j, 0, height - 1), c);
            difference =
                std::max(difference, 255 * std::abs(pair.reference.at(x, y, c) - warped(pair.previous, x, y, c)));
        }
        return difference < threshold(brightness);
    };
    Pixels one = constant({width / 2, height / 2}, 0), other = one;
    for (int y = 0; y < height / 2; ++y)
        for (int x = 0; x < width / 2; ++x) {
            bool mask = true;
            for (int k = 0; k < 4; ++k) mask = mask && passes(2 * x + k % 2, 2 * y + k / 2);
            for (int c = 0; c < 3 && mask; ++c)
                for (int k = 0; k < 4; ++k) {
                    one.at(x, y, c) += static_cast<float>(warped(before, 2 * x + k % 2, 2 * y + k / 2, c) / 4);
                    other.at(x, y, c) += after.at(2 * x + k % 2, 2 * y + k / 2, c) / 4;
                }
        }
    return plain_ssim(one, other);
}

}  // namespace

TEST_CASE("PSNR of a constant difference") {
    const Pixels black = constant({7, 5}, 0);
    CHECK(metrics::mean_squared_error(constant({7, 5}, 0.1f), black) == doctest::Approx(0.01));
    CHECK(metrics::psnr(0.01) == doctest::Approx(20));
    CHECK(metrics::psnr(1) == doctest::Approx(0));
}

TEST_CASE("PSNR takes the mean over pixels and channels") {
    const Pixels black = constant({2, 1}, 0);
    Pixels image = black;
    image.values = {0.5f, 0, 0, 0, 0.25f, 0};
    CHECK(metrics::mean_squared_error(image, black) == doctest::Approx((0.25 + 0.0625) / 6));
}

TEST_CASE("PSNR is capped at 100 dB") {
    CHECK(metrics::psnr(0) == 100);
    CHECK(metrics::psnr(1e-11) == 100);
    CHECK(metrics::psnr(1e-9) == doctest::Approx(90));
}

TEST_CASE("SSIM of an image with itself is 1") {
    const Pixels image = noise({20, 15}, 1);
    CHECK(*metrics::ssim(image, image) == doctest::Approx(1).epsilon(1e-12));
}

TEST_CASE("SSIM of two constants is the luminance term") {
    // (2·0.2·0.6 + c₁) / (0.2² + 0.6² + c₁)
    CHECK(*metrics::ssim(constant({11, 11}, 0.2f), constant({11, 11}, 0.6f)) ==
          doctest::Approx(0.2401 / 0.4001).epsilon(1e-6));
}

TEST_CASE("SSIM agrees with its definition") {
    for (const Size size : {Size{11, 11}, Size{11, 13}, Size{24, 17}}) {
        const Pixels reference = noise(size, 2);
        Pixels image = noise(size, 3);
        for (size_t i = 0; i < image.values.size(); ++i)
            image.values[i] = 0.7f * reference.values[i] + 0.3f * image.values[i];
        const double expected = plain_ssim(image, reference);
        CHECK(expected < 0.99);
        CHECK(*metrics::ssim(image, reference) == doctest::Approx(expected).epsilon(1e-9));
    }
}

TEST_CASE("SSIM has no value where no window fits") {
    CHECK_FALSE(metrics::ssim(constant({10, 40}, 0), constant({10, 40}, 0)));
    CHECK_FALSE(metrics::ssim(constant({40, 10}, 0), constant({40, 10}, 0)));
}

TEST_CASE("images of different form are not compared") {
    CHECK_THROWS_AS(metrics::mean_squared_error(constant({4, 4}, 0), constant({4, 5}, 0)), clarus::Error);
    CHECK_THROWS_AS(metrics::ssim(constant({14, 14}, 0), constant({14, 15}, 0)), clarus::Error);
    const Pixels grey{{4, 4}, 1, std::vector<float>(16)};
    CHECK_THROWS_AS(metrics::mean_squared_error(grey, grey), clarus::Error);
    CHECK_THROWS_AS(metrics::display_values(grey, ColorSpace::srgb), clarus::Error);
}

TEST_CASE("display values of srgb are clamped and free of alpha and NaN") {
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const Pixels image{{2, 1}, 4, {0.25f, -1, 2, 0.5f, nan, 1, 0, 0.5f}};
    const Pixels display = metrics::display_values(image, ColorSpace::srgb, 3);
    CHECK(display.channels == 3);
    CHECK(display.values == std::vector<float>{0.25f, 0, 1, 0, 1, 0});
}

TEST_CASE("display values of linear HDR are exposed, tone-mapped and encoded") {
    const float infinity = std::numeric_limits<float>::infinity();
    const Pixels image{{3, 1}, 3, {1, 0.5f, 0, infinity, -1, -infinity, 0.001f, 0, 0}};
    const Pixels display = metrics::display_values(image, ColorSpace::linear, 2);
    // 2/(1+2) and 1/(1+2) through the transfer function; 65504·2/(1 + 65504·2); 0.002/1.002 on its linear part.
    CHECK(display.values[0] == doctest::Approx(1.055 * std::pow(2.0 / 3, 1 / 2.4) - 0.055));
    CHECK(display.values[1] == doctest::Approx(1.055 * std::pow(1.0 / 3, 1 / 2.4) - 0.055));
    CHECK(display.values[2] == 0);
    CHECK(display.values[3] == doctest::Approx(1).epsilon(1e-5));
    CHECK(display.values[4] == 0);
    CHECK(display.values[5] == 0);
    CHECK(display.values[6] == doctest::Approx(12.92 * 0.002 / 1.002));
}

TEST_CASE("an exposure that makes light endless makes it white") {
    const Pixels image{{1, 1}, 3, {1e30f, std::numeric_limits<float>::infinity(), 1e-37f}};
    const Pixels display = metrics::display_values(image, ColorSpace::linear, 1e37f);
    CHECK(display.values[0] == doctest::Approx(1));
    CHECK(display.values[1] == doctest::Approx(1));
    CHECK(display.values[2] < 1e-30f);
}

TEST_CASE("a sequence's quality is the mean of its frames'") {
    const Pixels black = constant({16, 16}, 0);
    const std::vector<metrics::FrameQuality> frames{metrics::measure(constant({16, 16}, 0.1f), black),
                                                    metrics::measure(constant({16, 16}, 0.01f), black)};
    const metrics::SequenceQuality quality = metrics::summarise(frames);
    CHECK(quality.psnr == doctest::Approx(30));
    CHECK(quality.pooled_psnr == doctest::Approx(-10 * std::log10((0.01 + 0.0001) / 2)));
    CHECK(*quality.ssim == doctest::Approx((*frames[0].ssim + *frames[1].ssim) / 2));
    CHECK_THROWS_AS(metrics::summarise({}), clarus::Error);

    const Pixels tiny = constant({4, 4}, 0);
    CHECK_FALSE(metrics::summarise(std::vector{metrics::measure(tiny, tiny), frames[0]}).ssim);
}

TEST_CASE("the threshold of visible differences is the curve of docs/metrics.md") {
    for (const auto& [brightness, expected] : std::vector<std::pair<double, double>>{{0, 6},
                                                                                     {16, 7},
                                                                                     {32, 8},
                                                                                     {48, 9},
                                                                                     {64, 10},
                                                                                     {96, 12},
                                                                                     {128, 14},
                                                                                     {160, 16},
                                                                                     {192, 18},
                                                                                     {223.5, 20},
                                                                                     {255, 22}})
        CHECK(metrics::visible_difference(brightness) == doctest::Approx(expected).epsilon(1e-12));
}

TEST_CASE("IF-SSIM masks what was hidden") {
    Pair pair({6, 4});
    CHECK(pair.mask() == Mask{1, 1, 1, 1, 1, 1});
    pair.truth.depth.at(3, 2, 0) = 0.511f;  // a quarter of the block (1, 1)
    CHECK(pair.mask() == Mask{1, 1, 1, 1, 0, 1});
    pair.truth.depth.at(3, 2, 0) = 0.509f;
    CHECK(pair.mask() == Mask{1, 1, 1, 1, 1, 1});
    pair.previous_depth.at(0, 0, 0) =
        0.48f;  // seen from (1.5, 0): 0.5 · 0.5 + 0.5 · 0.5; from (0.4, 0): 0.6 · 0.48 + 0.4 · 0.5
    pair.truth.motion.at(0, 0, 0) = 0.6f;
    CHECK(pair.mask() == Mask{1, 1, 1, 1, 1, 1});
    pair.truth.motion.at(0, 0, 0) = 0.4f;
    CHECK(pair.mask() == Mask{0, 1, 1, 1, 1, 1});
    pair.truth.motion.at(0, 0, 0) = 1;
    pair.truth.motion.at(4, 0, 1) = std::numeric_limits<float>::quiet_NaN();
    CHECK(pair.mask() == Mask{1, 1, 0, 1, 1, 1});
}

TEST_CASE("IF-SSIM masks where the reference's colour changes visibly") {
    // At 100 levels a change of 12.25 is visible: f is 10 + 4 · 36/64. One pixel of 25 moves the mean by 11/75.
    Pair pair({6, 4});
    pair.previous.at(1, 1, 2) = 112 / 255.0f;
    CHECK(pair.mask() == Mask{1, 1, 1, 1, 1, 1});
    pair.previous.at(1, 1, 2) = 113 / 255.0f;
    CHECK(pair.mask() == Mask{0, 1, 1, 1, 1, 1});
    pair.truth.motion.at(1, 1, 1) = -1;  // (1, 0) was as bright
    CHECK(pair.mask() == Mask{1, 1, 1, 1, 1, 1});
    // Brighter surroundings hide it, up to two pixels away: 25 pixels at 108 have f = 12.75, and 20 of them 12.65.
    pair = Pair({6, 4}, 108 / 255.0f);
    pair.previous.at(1, 1, 2) = 120.7f / 255;
    CHECK(pair.mask() == Mask{1, 1, 1, 1, 1, 1});
    for (int y = 0; y < 4; ++y) pair.reference.at(3, y, 0) = pair.previous.at(3, y, 0) = 88 / 255.0f;
    CHECK(pair.mask() == Mask{0, 1, 1, 1, 1, 1});
}

TEST_CASE("IF-SSIM of frames without motion is the SSIM of the pooled frames") {
    const Pair pair({22, 22});
    Pixels before = constant({22, 22}, 0.2f), after = constant({22, 22}, 0.5f);
    for (int y = 0; y < 22; ++y)
        for (int x = 0; x < 22; ++x)
            for (int c = 0; c < 3; ++c) after.at(x, y, c) += (x + y) % 2 ? 0.1f : -0.1f;  // which pooling removes
    CHECK(*pair.inter_frame().ssim(before, after) ==
          doctest::Approx((2 * 0.1 + 1e-4) / (0.04 + 0.25 + 1e-4)).epsilon(1e-6));
    CHECK(*pair.inter_frame().ssim(before, before) == doctest::Approx(1).epsilon(1e-12));
    CHECK_FALSE(Pair({21, 22}).inter_frame().ssim(constant({21, 22}, 0), constant({21, 22}, 0)));
    CHECK_FALSE(Pair({1, 1}).inter_frame().ssim(constant({1, 1}, 0), constant({1, 1}, 0)));
    CHECK_THROWS_AS(pair.inter_frame().ssim(before, constant({22, 23}, 0)), clarus::Error);
    CHECK_THROWS_AS(pair.inter_frame().ssim(constant({24, 24}, 0), constant({24, 24}, 0)), clarus::Error);
}

TEST_CASE("IF-SSIM follows a surface that moves") {
    // A texture that moves three pixels to the right: aligned, nothing changes but the three columns that came in.
    const Size size{40, 30};
    const Pixels wide = noise({43, 30}, 5);
    Pair pair(size);
    for (int y = 0; y < size.height; ++y)
        for (int x = 0; x < size.width; ++x)
            for (int c = 0; c < 3; ++c) {
                pair.previous.at(x, y, c) = wide.at(x + 3, y, c);
                pair.reference.at(x, y, c) = wide.at(x, y, c);
                pair.truth.motion.at(x, y, 0) = -3;
            }
    CHECK(*pair.inter_frame().ssim(pair.previous, pair.reference) == doctest::Approx(1).epsilon(1e-9));
    CHECK(*Pair(size).inter_frame().ssim(pair.previous, pair.reference) < 0.5);
}

TEST_CASE("IF-SSIM agrees with its definition") {
    for (const Size size : {Size{22, 23}, Size{49, 36}}) {
        Pair pair(size);
        const Pixels bright = noise(size, 6), change = noise(size, 7), where = noise(size, 8);
        for (int y = 0; y < size.height; ++y) {
            for (int x = 0; x < size.width; ++x) {
                for (int c = 0; c < 3; ++c) {
                    pair.reference.at(x, y, c) = (x + 0.2f * bright.at(x, y, c)) / (size.width + 1);
                    pair.previous.at(x, y, c) = pair.reference.at(x, y, c) + 0.04f * change.at(x, y, c);
                }
                pair.truth.motion.at(x, y, 0) = 3 * where.at(x, y, 0) - 1.5f;
                pair.truth.motion.at(x, y, 1) = y < 4 ? -1000 : 3 * where.at(x, y, 1) - 1.5f;
                pair.truth.depth.at(x, y, 0) = 0.5f + 0.0102f * where.at(x, y, 2);
            }
        }
        const Pixels before = noise(size, 9);
        Pixels after = before;
        for (float& value : after.values) value = 0.9f * value + 0.05f;
        const Mask mask = pair.mask();
        const auto kept = static_cast<size_t>(std::count(mask.begin(), mask.end(), 1));
        CHECK(kept > mask.size() / 10);
        CHECK(kept < mask.size() * 9 / 10);
        CHECK(*pair.inter_frame().ssim(before, after) ==
              doctest::Approx(plain_if_ssim(pair, before, after)).epsilon(1e-5));
    }
}

TEST_CASE("pixel std is that of each value over the static segment") {
    metrics::PixelStd spread;
    CHECK_FALSE(spread.mean());
    Pixels frame = constant({2, 1}, 0.2f);
    spread.add(frame, false);
    CHECK_FALSE(spread.mean());
    // Of six values two are 0.2 and 0.4 by turns, whose deviation is 0.1, and one is 0, 0.3.
    frame.values = {0.4f, 0.4f, 0.2f, 0.2f, 0.2f, 0.5f};
    spread.add(frame, true);
    CHECK(*spread.mean() == doctest::Approx(255 * (0.1 + 0.1 + 0.15) / 6));
    // A third frame: 0.2, 0.4, 0.2 deviates by √(2/225); 0.2, 0.5, 0.5 by √2/10.
    frame.values = {0.2f, 0.2f, 0.2f, 0.2f, 0.2f, 0.5f};
    spread.add(frame, true);
    const double first = 255 * (2 * std::sqrt(2.0 / 225) + std::sqrt(2.0) / 10) / 6;
    CHECK(*spread.mean() == doctest::Approx(first));
    // Motion ends the segment; the frame that it ends on shows something new, and is in none.
    spread.add(constant({2, 1}, 1), false);
    spread.add(constant({2, 1}, 0), false);
    spread.add(constant({2, 1}, 0.5f), true);
    CHECK(*spread.mean() == doctest::Approx(first));
    spread.add(constant({2, 1}, 0.7f), true);
    CHECK(*spread.mean() == doctest::Approx((first + 255 * 0.1) / 2));
    CHECK_THROWS_AS(spread.add(constant({2, 2}, 0), true), clarus::Error);
}

TEST_CASE("IF-SSIM's mean is over the frames that have one") {
    std::vector<metrics::FrameQuality> frames(3);
    CHECK_FALSE(metrics::summarise(frames).if_ssim);
    frames[1].if_ssim = 0.5;
    frames[2].if_ssim = 0.75;
    CHECK(*metrics::summarise(frames).if_ssim == doctest::Approx(0.625));
}
