#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "cl/context.h"
#include "clarus/error.h"
#include "golden.h"
#include "test_device.h"

using namespace clarus;
using namespace clarus::test;

namespace {

constexpr int kFrames = 3;
using Outputs = std::vector<std::vector<float>>;
using Change = std::function<void(int, FrameDescription&)>;

std::string message(const std::function<void()>& call) {
    try {
        call();
    } catch (const Error& error) {
        CHECK(error.kind() == ErrorKind::invalid_argument);
        return error.what();
    }
    return "no error";
}

bool contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

/// The frame's vectors, twice as long, where a render pixel takes them from an image of this size; NaN elsewhere.
std::vector<float> spread(const FrameDescription& frame, Size size) {
    std::vector<float> wide(2 * static_cast<size_t>(size.width) * size.height, std::numeric_limits<float>::quiet_NaN());
    const Size render = frame.motion.size;
    const auto* vectors = static_cast<const float*>(frame.motion.host);
    for (int y = 0; y < render.height; ++y)
        for (int x = 0; x < render.width; ++x)
            for (int c = 0; c < 2; ++c) {
                const int at_x = (2 * x + 1) * size.width / (2 * render.width);
                const int at_y = (2 * y + 1) * size.height / (2 * render.height);
                wide[2 * (static_cast<size_t>(at_y) * size.width + at_x) + c] =
                    2 * vectors[2 * (static_cast<size_t>(y) * render.width + x) + c];
            }
    return wide;
}

/// What a filter makes of one linear frame of these colours.
std::vector<float> shown(
    const std::vector<float>& color, Size size, UpscalerOptions options,
    const std::function<void(FrameDescription&)>& change = [](FrameDescription&) {}) {
    options.color_space = ColorSpace::linear;
    Upscaler upscaler(test_device(), Model::filter("bilinear", 1), size, options);
    std::vector<float> output(color.size());
    FrameDescription frame;
    frame.color = {.host = const_cast<float*>(color.data()), .size = size};
    frame.output = {.host = output.data(), .size = size};
    change(frame);
    upscaler.submit(frame).wait();
    return output;
}

std::vector<float> radiance(Size size, float brightness) {
    std::vector<float> color;
    for (int i = 0; i < 3 * size.width * size.height; ++i)
        color.push_back(brightness * static_cast<float>(1 + i * 37 % 101) / 50);
    return color;
}

/// docs/integrating.md, "Exposure".
float automatic_exposure(const std::vector<float>& color, Size size) {
    const int columns = std::min(size.width, 128), rows = std::min(size.height, 128);
    double sum = 0;
    for (int row = 0; row < rows; ++row)
        for (int column = 0; column < columns; ++column) {
            const int x = (2 * column + 1) * size.width / (2 * columns), y = (2 * row + 1) * size.height / (2 * rows);
            const float* pixel = &color[3 * (static_cast<size_t>(y) * size.width + x)];
            const auto light = [](float v) { return v > 0 ? std::min(v, 65504.0f) : 0; };
            sum += std::log2(
                std::max(0.2126 * light(pixel[0]) + 0.7152 * light(pixel[1]) + 0.0722 * light(pixel[2]), 1e-4));
        }
    return static_cast<float>(1 / (9.6 * std::exp2(sum / (columns * rows))));
}

double largest_ratio(const std::vector<float>& a, const std::vector<float>& b) {
    double largest = 1;
    for (size_t i = 0; i < a.size(); ++i) {
        const double x = std::max(std::abs(a[i]), 1e-3f), y = std::max(std::abs(b[i]), 1e-3f);
        largest = std::max({largest, x / y, y / x});
    }
    return largest;
}

}  // namespace

TEST_CASE("motion of another size is that of each render pixel's centre" * doctest::test_suite("golden")) {
    const Golden golden("enss_x2_table");
    const Outputs plain = run(golden, {}, kFrames).outputs;
    const Size render = golden.render;
    for (const Size size : {Size{2 * render.width, 2 * render.height}, Size{render.width * 3 / 2, 3 * render.height},
                            Size{render.width, render.height}}) {
        CAPTURE(size.width);
        UpscalerOptions options;
        options.motion_size = size;
        std::vector<float> wide;
        const Outputs outputs = run(golden, options, kFrames, [&](int, FrameDescription& frame) {
                                    wide = spread(frame, size);
                                    frame.motion = {.host = wide.data(), .size = size};
                                    const Vec2 scale = frame.motion_scale.value_or(Vec2{1, 1});
                                    frame.motion_scale = Vec2{scale.x / 2, scale.y / 2};
                                }).outputs;
        CHECK(outputs == plain);
    }
    UpscalerOptions options;
    options.motion_size = Size{2 * render.width, 2 * render.height};
    CHECK(contains(message([&] { run(golden, options, 1); }), "frame.motion"));
    options.motion_size = Size{0, 4};
    CHECK(contains(message([&] { run(golden, options, 1); }), "options.motion_size: 0x4"));
}

TEST_CASE("an exposure that is an image is the same as a number" * doctest::test_suite("small")) {
    const Size size{9, 5};
    const std::vector<float> color = radiance(size, 3);
    const std::vector<float> expected = shown(color, size, {}, [](FrameDescription& frame) { frame.exposure = 2.5f; });
    const std::vector<float> plain = shown(color, size, {});
    CHECK(expected != plain);

    UpscalerOptions options;
    options.exposure_format = ImageFormat{ElementType::f32, 1};
    const auto by_image = [&](float value, float factor) {
        return shown(color, size, options, [&](FrameDescription& frame) {
            frame.exposure = factor;
            frame.exposure_image = {.host = &value, .size = {1, 1}};
        });
    };
    CHECK(by_image(2.5f, 1) == expected);
    CHECK(by_image(2, 1.25f) == expected);
    constexpr float infinity = std::numeric_limits<float>::infinity();
    for (const float useless : {0.0f, -1.0f, infinity, std::numeric_limits<float>::quiet_NaN()})
        CHECK(by_image(useless, 2.5f) == expected);

    const cl::Context& context = test_device().context().context();
    float value = 2.5f;
    const cl::Buffer buffer(context, CL_MEM_READ_ONLY | CL_MEM_COPY_HOST_PTR, sizeof value, &value);
    CHECK(shown(color, size, options, [&](FrameDescription& frame) {
              frame.exposure_image = {.buffer = buffer(), .size = {1, 1}};
          }) == expected);
    options.exposure_format = ImageFormat{ElementType::f16, 4};
    std::vector<uint16_t> half{0x4100, 0, 0, 0};
    CHECK(shown(color, size, options, [&](FrameDescription& frame) {
              frame.exposure_image = {.host = half.data(), .size = {1, 1}};
          }) == expected);

    CHECK(contains(message([&] { shown(color, size, options); }), "frame.exposure_image: none"));
    CHECK(contains(message([&] {
                       shown(color, size, options, [&](FrameDescription& frame) {
                           frame.exposure_image = {.host = half.data(), .size = {2, 1}};
                       });
                   }),
                   "frame.exposure_image: 2x1 pixels, expected 1x1"));
    CHECK(contains(message([&] {
                       shown(color, size, {}, [&](FrameDescription& frame) {
                           frame.exposure_image = {.host = half.data(), .size = {1, 1}};
                       });
                   }),
                   "options.exposure_format is not set"));
    options.automatic_exposure = true;
    CHECK(contains(message([&] { shown(color, size, options); }), "options.automatic_exposure"));
    UpscalerOptions encoded;
    encoded.automatic_exposure = true;
    CHECK(contains(message([&] { Upscaler(test_device(), Model::filter("bilinear", 1), size, encoded); }),
                   "display-encoded colour has no exposure"));
}

TEST_CASE("an automatic exposure follows what colours are" * doctest::test_suite("small")) {
    UpscalerOptions options;
    options.automatic_exposure = true;
    for (const Size size : {Size{1, 1}, Size{7, 3}, Size{150, 2}}) {
        CAPTURE(size.width);
        for (const float brightness : {1e-3f, 1.0f, 900.0f}) {
            std::vector<float> color = radiance(size, brightness);
            if (size.width > 1) color[1] = std::numeric_limits<float>::quiet_NaN();
            const float exposure = automatic_exposure(color, size);
            const std::vector<float> expected =
                shown(color, size, {}, [&](FrameDescription& frame) { frame.exposure = exposure; });
            CHECK(largest_ratio(shown(color, size, options), expected) < 1.001);
            // The frame's own is a factor of it.
            CHECK(largest_ratio(
                      shown(color, size, options, [](FrameDescription& frame) { frame.exposure = 0.5f; }),
                      shown(color, size, {}, [&](FrameDescription& frame) { frame.exposure = exposure / 2; })) < 1.001);
        }
        const std::vector<float> black(3 * static_cast<size_t>(size.width) * size.height, 0.0f);
        CHECK(shown(black, size, options) == black);
    }
}

TEST_CASE("a model's frames are exposed by an image or by themselves as by a number" * doctest::test_suite("golden")) {
    const Golden golden("enss_x2_table");
    UpscalerOptions options;
    options.color_space = ColorSpace::linear;
    const auto number = [](int t) { return 0.5f + static_cast<float>(t); };
    const Outputs expected =
        run(golden, options, kFrames, [&](int t, FrameDescription& frame) { frame.exposure = number(t); }).outputs;
    UpscalerOptions by_image = options;
    by_image.exposure_format = ImageFormat{ElementType::f32, 1};
    float value = 0;
    CHECK(run(golden, by_image, kFrames, [&](int t, FrameDescription& frame) {
              value = number(t);
              frame.exposure_image = {.host = &value, .size = {1, 1}};
          }).outputs == expected);
    UpscalerOptions automatic = options;
    automatic.automatic_exposure = true;
    const Outputs adapted = run(golden, automatic, kFrames).outputs;
    for (int t = 0; t < kFrames; ++t) CHECK(adapted[t] != expected[t]);
}
