#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
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

/// A factor that makes too bright what is infinitely bright, whatever its exposure.
constexpr float kBright = 1e6f;

/// The exposure that a frame with this factor was shown with: what is too bright comes out as 4095 over all of it
/// (docs/conventions.md, "Colour").
float exposure_of(const std::vector<float>& shown, float factor = kBright) {
    return 4095 / shown[shown.size() - 3] / factor;
}

std::vector<float> with_a_sun(std::vector<float> color) {
    std::fill(color.end() - 3, color.end(), std::numeric_limits<float>::infinity());
    return color;
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

TEST_CASE("motion of one size goes with render sizes that change") {
    const Size largest{12, 8}, wide{29, 17};
    const auto outputs = [&](bool is_spread) {
        UpscalerOptions options;
        options.dynamic_resolution = true;
        if (is_spread) options.motion_size = wide;
        Upscaler upscaler(test_device(), Model::filter("fsr2", 2), largest, options);
        Outputs all;
        for (const Size render : {largest, Size{9, 6}, Size{11, 7}, largest}) {
            const size_t pixels = static_cast<size_t>(render.width) * render.height;
            std::vector<float> color = radiance(render, 0.4f), depth(pixels, 0.5f), motion(2 * pixels), spread_motion;
            for (size_t i = 0; i < motion.size(); ++i) motion[i] = static_cast<float>(i * 29 % 17) / 8 - 1;
            std::vector<float>& output = all.emplace_back(3 * 4 * static_cast<size_t>(largest.width) * largest.height);
            FrameDescription frame;
            frame.render_size = render;
            frame.color = {.host = color.data(), .size = render};
            frame.depth = {.host = depth.data(), .size = render};
            frame.motion = {.host = motion.data(), .size = render};
            if (is_spread) {
                spread_motion = spread(frame, wide);
                frame.motion = {.host = spread_motion.data(), .size = wide};
                frame.motion_scale = Vec2{0.5f, 0.5f};
            }
            const Size shown = upscaler.output_size(render);
            output.resize(3 * static_cast<size_t>(shown.width) * shown.height);
            frame.output = {.host = output.data(), .size = shown};
            upscaler.submit(frame).wait();
        }
        return all;
    };
    CHECK(outputs(true) == outputs(false));
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
    for (const Size size : {Size{1, 1}, Size{7, 3}, Size{150, 2}, Size{3, 300}}) {
        CAPTURE(size.width);
        for (const float brightness : {1e-3f, 1.0f, 900.0f}) {
            std::vector<float> color = with_a_sun(radiance(size, brightness));
            if (size.width > 1) color[1] = std::numeric_limits<float>::quiet_NaN(), color[3] = -5;
            const float exposure = automatic_exposure(color, size);
            for (const float factor : {kBright, 3 * kBright})
                CHECK(
                    exposure_of(shown(color, size, options, [&](FrameDescription& frame) { frame.exposure = factor; }),
                                factor) == doctest::Approx(exposure).epsilon(1e-3));
        }
        const std::vector<float> black(3 * static_cast<size_t>(size.width) * size.height, 0.0f);
        CHECK(shown(black, size, options) == black);
    }
}

TEST_CASE("an automatic exposure reads colours as they lie") {
    const Size size{9, 5};
    const ImageFormat halves{ElementType::f16, 4};
    constexpr size_t pitch = 12 * 4 * sizeof(uint16_t);
    std::vector<uint16_t> bytes(pitch / sizeof(uint16_t) * size.height, 0x7bff);
    std::vector<float> color;
    for (int y = 0; y < size.height; ++y)
        for (int x = 0; x < size.width; ++x)
            for (int c = 0; c < 3; ++c) {  // 1 and 4
                const bool is_bright = (x + y) % 3 == 0;
                bytes[y * pitch / sizeof(uint16_t) + 4 * x + c] = is_bright ? 0x4400 : 0x3c00;
                color.push_back(is_bright ? 4.0f : 1.0f);
            }
    color = with_a_sun(color);
    for (int c = 0; c < 3; ++c) bytes[(size.height - 1) * pitch / sizeof(uint16_t) + 4 * (size.width - 1) + c] = 0x7c00;
    UpscalerOptions options;
    options.automatic_exposure = true;
    options.color_format = halves;
    const std::vector<float> output = shown(color, size, options, [&](FrameDescription& frame) {
        frame.color = {.host = bytes.data(), .row_pitch = pitch, .size = size};
        frame.exposure = kBright;
    });
    CHECK(exposure_of(output) == doctest::Approx(automatic_exposure(color, size)).epsilon(1e-3));
}

TEST_CASE("an automatic exposure changes by a tenth from frame to frame, at once after a cut, and is kept") {
    const Size size{7, 3};
    const std::vector<float> dark = with_a_sun(radiance(size, 0.1f)), bright = with_a_sun(radiance(size, 50));
    const float first = automatic_exposure(dark, size), second = automatic_exposure(bright, size);
    const auto expected = [&](int frames) { return first * std::pow(second / first, 1 - std::pow(0.9f, frames)); };
    UpscalerOptions options;
    options.automatic_exposure = true;
    options.color_space = ColorSpace::linear;
    std::vector<float> output(dark.size());
    const auto made = [&] { return Upscaler(test_device(), Model::filter("bilinear", 1), size, options); };
    const auto exposure = [&](Upscaler& upscaler, const std::vector<float>& color, bool reset, float sixtieths = 1) {
        FrameDescription frame;
        frame.color = {.host = const_cast<float*>(color.data()), .size = size};
        frame.output = {.host = output.data(), .size = size};
        frame.reset = reset;
        frame.exposure = kBright;
        frame.frame_seconds = sixtieths / 60;
        upscaler.submit(frame).wait();
        return exposure_of(output);
    };
    Upscaler upscaler = made();
    CHECK(exposure(upscaler, dark, false) == doctest::Approx(first).epsilon(1e-3));
    CHECK(exposure(upscaler, bright, false) == doctest::Approx(expected(1)).epsilon(1e-3));
    const std::vector<std::byte> history = upscaler.save_history();
    CHECK(exposure(upscaler, bright, false) == doctest::Approx(expected(2)).epsilon(1e-3));
    CHECK(exposure(upscaler, bright, true) == doctest::Approx(second).epsilon(1e-3));
    Upscaler other = made();
    other.restore_history(history);
    CHECK(exposure(other, bright, false) == doctest::Approx(expected(2)).epsilon(1e-3));
    // Four frames' way in one that took as long.
    CHECK(exposure(other, bright, false, 4) == doctest::Approx(expected(6)).epsilon(1e-3));
    CHECK(exposure(other, dark, false, 0) == doctest::Approx(expected(6)).epsilon(1e-3));
    for (const float none : {-1.0f, std::numeric_limits<float>::quiet_NaN()})
        CHECK(contains(message([&] { exposure(other, bright, false, none); }), "frame.frame_seconds"));
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
