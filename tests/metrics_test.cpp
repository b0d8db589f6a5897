#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <random>

#include "clarus/error.h"
#include "metrics/display.h"
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
