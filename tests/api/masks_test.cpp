#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "clarus/error.h"
#include "golden.h"
#include "test_device.h"

using namespace clarus;
using namespace clarus::test;

// docs/integrating.md, "Masks".
namespace {

constexpr int kFrames = 3;
using Outputs = std::vector<std::vector<float>>;

Outputs shown(const Golden& golden, const UpscalerOptions& options,
              const std::function<void(int, FrameDescription&)>& change) {
    return run(golden, options, kFrames, change).outputs;
}

/// What the model makes of the first frames, and what a filter does.
struct Plain {
    explicit Plain(const std::string& name) : golden(name) {
        model = run(golden, {}, kFrames).outputs;
        Golden filter(name);
        filter.model = Model::filter("bicubic", golden.model.scale());
        bicubic = run(filter, {}, kFrames).outputs;
    }
    Golden golden;
    Outputs model, bicubic;
};

float largest_difference(const std::vector<float>& a, const std::vector<float>& b) {
    float largest = 0;
    for (size_t i = 0; i < a.size(); ++i) largest = std::max(largest, std::abs(a[i] - b[i]));
    return largest;
}

Image image_of(std::vector<float>& mask, Size size) { return {.host = mask.data(), .size = size}; }

constexpr ImageFormat kFloats{ElementType::f32, 1};

}  // namespace

TEST_CASE("where a mask is 1, output and history are the frame's own colour; where it is 0, nothing changes" *
          doctest::test_suite("golden")) {
    for (const char* name : {"enss_x2_table", "mnss_x2", "nsrr_x2_checked"}) {
        CAPTURE(name);
        const Plain plains(name);
        const auto& [golden, plain, bicubic] = plains;
        const size_t pixels = static_cast<size_t>(golden.render.width) * golden.render.height;
        std::vector<float> none(pixels, 0.0f), all(pixels, 1.0f);
        none.front() = std::numeric_limits<float>::quiet_NaN();
        UpscalerOptions options;
        options.reactive_format = kFloats;

        CHECK(shown(golden, options, [](int, FrameDescription&) {}) == plain);
        CHECK(shown(golden, options, [&](int, FrameDescription& frame) {
                  frame.reactive_mask = image_of(none, golden.render);
              }) == plain);

        const Outputs masked = shown(golden, options, [&](int t, FrameDescription& frame) {
            if (t < 2) frame.reactive_mask = image_of(all, golden.render);
        });
        CHECK(largest_difference(masked[0], bicubic[0]) < 1e-5f);
        CHECK(largest_difference(masked[1], bicubic[1]) < 1e-5f);
        CHECK(largest_difference(masked[1], plain[1]) > 1e-3f);
        CHECK(largest_difference(masked[2], bicubic[2]) > 1e-3f);
    }
}

TEST_CASE("what a mask leaves alone is not the next frame's history" * doctest::test_suite("golden")) {
    const Plain plains("enss_x2_table");
    const Golden& golden = plains.golden;
    const size_t pixels = static_cast<size_t>(golden.render.width) * golden.render.height;
    std::vector<float> all(pixels, 1.0f);
    UpscalerOptions options;
    options.reactive_format = kFloats;
    const Outputs masked = shown(golden, options, [&](int t, FrameDescription& frame) {
        if (t == 0) frame.reactive_mask = image_of(all, golden.render);
    });
    CHECK(largest_difference(masked[1], plains.model[1]) > 1e-4f);
}

TEST_CASE("of two masks the larger counts, part by part, of any type" * doctest::test_suite("golden")) {
    const Plain plains("enss_x2_table");
    const auto& [golden, plain, bicubic] = plains;
    const auto [width, height] = golden.render;
    std::vector<float> left(static_cast<size_t>(width) * height);
    std::vector<uint8_t> right(2 * left.size());  // of two channels, the first counts
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const size_t pixel = static_cast<size_t>(y) * width + x;
            left[pixel] = x < width / 3 ? 1.0f : 0.0f;
            right[2 * pixel] = x > 2 * width / 3 ? 255 : 0;
            right[2 * pixel + 1] = 255;
        }
    UpscalerOptions options;
    options.reactive_format = kFloats;
    options.transparency_format = ImageFormat{ElementType::u8, 2};
    const Outputs masked = shown(golden, options, [&](int, FrameDescription& frame) {
        frame.reactive_mask = image_of(left, golden.render);
        frame.transparency_mask = {.host = right.data(), .size = golden.render};
    });
    const auto at = [&](const Outputs& outputs, int x) {
        const size_t first = (static_cast<size_t>(height) * 2 * width + x) * 3;  // of the row in the middle
        return std::vector<float>(outputs[0].begin() + first, outputs[0].begin() + first + 3);
    };
    CHECK(largest_difference(at(masked, 0), at(bicubic, 0)) < 1e-5f);
    CHECK(largest_difference(at(masked, 2 * width - 1), at(bicubic, 2 * width - 1)) < 1e-5f);
    CHECK(at(masked, width) == at(plain, width));
}

TEST_CASE("masks that nobody would read are refused, models without history take them" * doctest::test_suite("small")) {
    const Size size{6, 5};
    std::vector<float> color(90, 0.5f), output(360), mask(30, 1.0f);
    FrameDescription frame;
    frame.color = {.host = color.data(), .size = size};
    frame.output = {.host = output.data(), .size = {12, 10}};
    frame.reactive_mask = image_of(mask, size);
    UpscalerOptions options;
    Upscaler unaware(test_device(), Model::filter("bicubic", 2), size, options);
    CHECK_THROWS_WITH_AS(unaware.submit(frame), doctest::Contains("reactive_format"), Error);
    options.reactive_format = kFloats;
    Upscaler aware(test_device(), Model::filter("bicubic", 2), size, options);
    aware.submit(frame).wait();
    CHECK(output.front() == doctest::Approx(0.5));
    std::vector<float> depth(30, 0.5f), motion(60, 0.0f);
    for (size_t i = 0; i < color.size(); ++i) color[i] = static_cast<float>(i % 7) / 7;
    aware.submit(frame).wait();
    const std::vector<float> bicubic = output;
    Upscaler temporal(test_device(), Model::filter("fsr2", 2), size, options);
    frame.depth = image_of(depth, size);
    frame.motion = image_of(motion, size);
    temporal.submit(frame).wait();
    CHECK(largest_difference(output, bicubic) < 1e-5f);
    frame.reactive_mask.size = {12, 10};
    CHECK_THROWS_WITH_AS(aware.submit(frame), doctest::Contains("frame.reactive_mask"), Error);
    options.reactive_format->channels = 0;
    CHECK_THROWS_WITH_AS(Upscaler(test_device(), Model::filter("bicubic", 2), size, options),
                         doctest::Contains("options.reactive_format"), Error);
}
