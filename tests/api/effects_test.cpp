#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "clarus/error.h"
#include "golden.h"
#include "one_frame.h"
#include "test_device.h"

using namespace clarus;
using namespace clarus::test;

namespace {

std::vector<float> filtered(const std::vector<float>& color, Size size, const UpscalerOptions& options) {
    Upscaler upscaler(test_device(), Model::filter("nearest", 1), size, options);
    return upscaled(upscaler, color);
}

std::vector<float> stairs(Size size) {
    std::vector<float> color;
    for (int y = 0; y < size.height; ++y)
        for (int x = 0; x < size.width; ++x) color.insert(color.end(), 3, y <= x / 3 ? 1.0f : 0.0f);
    return color;
}

}  // namespace

TEST_CASE("sharpening changes what is shown and not the history" * doctest::test_suite("golden")) {
    constexpr float kAmount = 0.15f;
    const Golden golden("mnss_x2");
    UpscalerOptions options;
    const std::vector<std::vector<float>> plain = run(golden, options, 3).outputs;
    options.sharpen = kAmount;
    const std::vector<std::vector<float>> sharpened = run(golden, options, 3).outputs;
    const int width = golden.render.width * 2, height = golden.render.height * 2;
    for (int t = 0; t < 3; ++t) {
        float largest = 0;
        const auto at = [&](int c, int x, int y) {
            return plain[t][(std::clamp(y, 0, height - 1) * width + std::clamp(x, 0, width - 1)) * 3 + c];
        };
        for (int y = 0; y < height; ++y) {
            for (int x = 0; x < width; ++x) {
                for (int c = 0; c < 3; ++c) {
                    const float corners =
                        at(c, x - 1, y - 1) + at(c, x + 1, y - 1) + at(c, x - 1, y + 1) + at(c, x + 1, y + 1);
                    const float expected = std::clamp((1 + 4 * kAmount) * at(c, x, y) - kAmount * corners, 0.0f, 1.0f);
                    largest = std::max(largest, std::abs(expected - sharpened[t][(y * width + x) * 3 + c]));
                }
            }
        }
        CHECK(largest < 1e-5f);
    }
}

TEST_CASE("antialiasing comes before or after a model" * doctest::test_suite("small")) {
    const Size size{12, 7};
    const std::vector<float> stair = stairs(size);
    UpscalerOptions before, after;
    before.antialias_input = Antialiasing::mlaa;
    after.antialias = Antialiasing::mlaa;
    CHECK(filtered(stair, size, {}) == stair);
    CHECK(filtered(stair, size, before) != stair);
    CHECK(filtered(stair, size, before) == filtered(stair, size, after));
}

TEST_CASE("antialiasing changes what is shown and not the history" * doctest::test_suite("small")) {
    constexpr int kFrames = 6;
    const Size size{12, 7};
    std::vector<float> color = stairs(size), depth(color.size() / 3, 0.5f), motion(2 * depth.size(), 0.0f);
    const auto shown = [&](const UpscalerOptions& options) {
        Upscaler upscaler(test_device(), Model::filter("fsr2", 1), size, options);
        std::vector<std::vector<float>> outputs;
        for (int t = 0; t < kFrames; ++t) {
            FrameDescription frame;
            frame.color = {.host = color.data(), .size = size};
            frame.depth = {.host = depth.data(), .size = size};
            frame.motion = {.host = motion.data(), .size = size};
            frame.output = {.host = outputs.emplace_back(color.size()).data(), .size = size};
            upscaler.submit(frame).wait();
        }
        return outputs;
    };
    UpscalerOptions options;
    const std::vector<std::vector<float>> plain = shown(options);
    options.antialias = Antialiasing::mlaa;
    const std::vector<std::vector<float>> antialiased = shown(options);
    for (int t = 0; t < kFrames; ++t) CHECK(antialiased[t] == filtered(plain[t], size, options));
    CHECK(antialiased.front() != plain.front());  // so that a history of what is shown would differ, too
}

TEST_CASE("a sharpening beyond its range is refused" * doctest::test_suite("small")) {
    for (const float amount : {-0.1f, 1.5f}) {
        UpscalerOptions options;
        options.sharpen = amount;
        CHECK_THROWS_WITH_AS(Upscaler(test_device(), Model::filter("bicubic", 2), {4, 4}, options),
                             doctest::Contains("options.sharpen"), Error);
    }
}
