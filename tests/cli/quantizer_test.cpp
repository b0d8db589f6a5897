#include "cli/quantizer.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "cli/compensated_rounding.h"

using namespace clarus;
using namespace clarus::cli;

namespace {

constexpr Size kSize{40, 30};

/// Channels of an image, each a smooth wave, as what layers read is: [height][width][channels].
std::vector<float> waves(int channels) {
    std::vector<float> image;
    for (int y = 0; y < kSize.height; ++y)
        for (int x = 0; x < kSize.width; ++x)
            for (int c = 0; c < channels; ++c)
                image.push_back(1 + std::sin(0.2f * static_cast<float>(x + c) + 0.1f * static_cast<float>(y)));
    return image;
}

LayerSamples samples_of(const std::vector<float>& image, int channels, int kernel) {
    LayerSamples samples(channels, kernel);
    samples.add(image, kSize, image.size(), 400);
    return samples;
}

}  // namespace

TEST_SUITE("small") {
    TEST_CASE("numbers reach over what is read, and 0 is one of them") {
        const auto quantization = [](std::vector<float> image, double percent) {
            LayerSamples samples(1, 1);
            samples.add(image, {static_cast<int>(image.size()), 1}, image.size(), 1);
            return quantization_of(samples, percent);
        };
        const graph::Quantization both = quantization({-1, 0.5f, 4}, 100);
        CHECK(both.scale == doctest::Approx(5.0 / 255));
        CHECK(both.zero_point == 51);
        CHECK(quantization({2, 3}, 100).zero_point == 0);
        CHECK(quantization({-2, -3}, 100).zero_point == 255);
        CHECK(quantization({0, 0}, 100).scale > 0);
        // What is not finite is left out.
        CHECK(quantization({std::numeric_limits<float>::infinity(), 1}, 100).scale == doctest::Approx(1.0 / 255));
        std::vector<float> spike(1000, 1.0f);
        spike[500] = 100;
        CHECK(quantization(spike, 99.8).scale == doctest::Approx(1.0 / 255));
    }

    TEST_CASE("the percentage is taken whose numbers are nearest to what is read") {
        std::vector<float> spike(1000);
        for (size_t i = 0; i < spike.size(); ++i) spike[i] = static_cast<float>(i) / 1000;
        const double percentages[] = {100, 50};
        LayerSamples samples(1, 1);
        samples.add(spike, {1000, 1}, spike.size(), 1);
        CHECK(closest_quantization(samples, percentages) == quantization_of(samples, 100));
    }

    TEST_CASE("patches are what a kernel covers, 0 outside of the image") {
        LayerSamples samples(2, 3);
        samples.add({1, 10, 2, 20, 3, 30, 4, 40}, {2, 2}, 4, 4);
        const std::vector<float>& patches = samples.patches();
        REQUIRE(patches.size() == 4 * 18);
        const std::vector<float> first{0, 0, 0, 0, 1, 2, 0, 3, 4, 0, 0, 0, 0, 10, 20, 0, 30, 40};
        CHECK(std::equal(first.begin(), first.end(), patches.begin()));
    }

    TEST_CASE("weights that are rounded together lose less than each by itself") {
        const int channels = 3, taps = 9;
        const LayerSamples samples = samples_of(waves(channels), channels, 3);
        const CompensatedRounding rounding(samples.patches(), channels * taps, 0, channels * taps);
        std::mt19937 random(1);
        std::uniform_real_distribution<float> weight(-1, 1);
        double together = 0, alone = 0;
        for (int row = 0; row < 20; ++row) {
            std::vector<float> weights(channels * taps);
            std::vector<std::int8_t> each;
            const double scale = 1.0 / 20;
            for (float& value : weights) {
                value = weight(random);
                each.push_back(static_cast<std::int8_t>(std::lround(value / scale)));
            }
            const std::vector<std::int8_t> rounded = rounding.round(weights, scale, 127);
            for (size_t i = 0; i < rounded.size(); ++i) CHECK(std::abs(rounded[i] - each[i]) < 20);
            together += rounding.error(weights, rounded, scale);
            alone += rounding.error(weights, each, scale);
        }
        CHECK(together < 0.25 * alone);
    }

    TEST_CASE(
        "a quantized layer's mean result is the floating-point one's, in groups and sets, and of zeros its bias") {
        const int channels = 4;
        const std::vector<float> image = waves(channels);
        const LayerSamples samples = samples_of(image, channels, 1);
        graph::Parameters layer{2, channels, 2, true, 1, 2};
        layer.weights = {0.3f, -0.7f, 0.2f, 0.9f, 0, 0, 1e-3f, -2e-3f};
        layer.biases = {0.1f, -0.2f, 0.625f, 0};
        const graph::Quantization input = quantization_of(samples, 99);
        const graph::QuantizedWeights weights = WeightQuantizer(layer, samples).weights(input);
        REQUIRE(weights.weights.size() == 8);
        for (size_t channel = 0; channel < 4; ++channel) {
            double wanted = 0, made = 0;
            const size_t pixels = image.size() / channels, first = channel % 2 * 2;
            for (size_t pixel = 0; pixel < pixels; ++pixel) {
                wanted += layer.biases[channel];
                double sum = weights.biases[channel];
                for (size_t i = 0; i < 2; ++i) {
                    const float value = image[pixel * channels + first + i];
                    const double number =
                        std::clamp<double>(std::nearbyint(value / input.scale) + input.zero_point, 0.0, 255.0);
                    wanted += value * layer.weights[2 * channel + i];
                    sum += (number - input.zero_point) * weights.weights[2 * channel + i];
                }
                made += sum * input.scale * weights.scales[channel];
            }
            CHECK(made / static_cast<double>(pixels) ==
                  doctest::Approx(wanted / static_cast<double>(pixels)).epsilon(1e-4));
        }
    }
}
