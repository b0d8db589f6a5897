#include <doctest/doctest.h>

#include <cmath>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "clarus/error.h"
#include "golden.h"
#include "test_device.h"

using namespace clarus;
using namespace clarus::test;

// docs/integrating.md, "Alpha".
namespace {

constexpr int kFrames = 2;
constexpr float kClose = 1e-6f;
using Outputs = std::vector<std::vector<float>>;

UpscalerOptions with_alpha(UpscalerOptions options = {}) {
    options.alpha = true;
    options.color_format = options.output_format = {ElementType::f32, 4};
    return options;
}

/// Colours with this alpha.
std::vector<float> interleaved(const FrameDescription& frame, const std::vector<float>& alpha) {
    const auto* color = static_cast<const float*>(frame.color.host);
    std::vector<float> result;
    for (size_t i = 0; i < alpha.size(); ++i) {
        result.insert(result.end(), color + 3 * i, color + 3 * i + 3);
        result.push_back(alpha[i]);
    }
    return result;
}

Outputs upscaled(const Golden& golden, const UpscalerOptions& options, const std::vector<float>& alpha) {
    std::vector<float> color;
    return run(golden, options, kFrames,
               [&](int, FrameDescription& frame) {
                   color = interleaved(frame, alpha);
                   frame.color.host = color.data();
               })
        .outputs;
}

std::vector<float> channel(const std::vector<float>& image, int channels, int c) {
    std::vector<float> result;
    for (size_t i = c; i < image.size(); i += channels) result.push_back(image[i]);
    return result;
}

std::vector<float> noise(size_t count) {
    std::mt19937 random(3);
    std::uniform_real_distribution<float> values(0, 1);
    std::vector<float> result(count);
    for (float& value : result) value = values(random);
    return result;
}

/// What bicubic makes of the alpha as a grey picture.
Outputs as_grey(Golden golden, const UpscalerOptions& options, const std::vector<float>& alpha, bool is_jittered) {
    golden.model = Model::filter("bicubic", golden.model.scale());
    std::vector<float> grey;
    for (const float value : alpha) grey.insert(grey.end(), 3, value);
    return run(golden, options, kFrames,
               [&](int, FrameDescription& frame) {
                   frame.color.host = grey.data();
                   if (!is_jittered) frame.jitter = {};
               })
        .outputs;
}

std::string message(const UpscalerOptions& options) {
    try {
        Upscaler(test_device(), Model::filter("bicubic", 2), {8, 8}, options);
    } catch (const Error& error) {
        CHECK(error.kind() == ErrorKind::invalid_argument);
        return error.what();
    }
    return "no error";
}

}  // namespace

TEST_CASE("colour's alpha is the output's, beside the same colours" * doctest::test_suite("golden")) {
    for (const char* name : {"enss_x2_table", "mnss_x2", "srpo_x2", "nsrr_x2_checked"}) {
        CAPTURE(name);
        const Golden golden(name);
        const size_t pixels = static_cast<size_t>(golden.render.width) * golden.render.height;
        const std::vector<float> alpha = noise(pixels);
        const Outputs plain = run(golden, {}, kFrames).outputs, results = upscaled(golden, with_alpha(), alpha);
        const Outputs grey = as_grey(golden, {}, alpha, std::string(name) != "srpo_x2");
        for (int t = 0; t < kFrames; ++t) {
            for (int c = 0; c < 3; ++c) CHECK(channel(results[t], 4, c) == channel(plain[t], 3, c));
            const std::vector<float> made = channel(results[t], 4, 3), expected = channel(grey[t], 3, 0);
            for (size_t i = 0; i < made.size(); ++i) CHECK(std::abs(made[i] - expected[i]) <= kClose);
        }
        for (const std::vector<float>& result : upscaled(golden, with_alpha(), std::vector<float>(pixels, 1)))
            for (const float value : channel(result, 4, 3)) CHECK(value == 1);
    }
}

TEST_CASE("alpha is of the output's size, neither sharpened nor antialiased") {
    const Golden golden("enss_x2_table");
    const std::vector<float> alpha = noise(static_cast<size_t>(golden.render.width) * golden.render.height);
    UpscalerOptions options;
    options.output_size = Size{3 * golden.render.width, 3 * golden.render.height};
    const std::vector<float> plain = channel(upscaled(golden, with_alpha(options), alpha)[0], 4, 3);
    CHECK(plain.size() == static_cast<size_t>(options.output_size->width) * options.output_size->height);
    options.sharpen = 0.5f;
    options.antialias = options.antialias_input = Antialiasing::mlaa;
    CHECK(channel(upscaled(golden, with_alpha(options), alpha)[0], 4, 3) == plain);
}

TEST_CASE("linear light keeps its alpha; without the option it is 1") {
    const Golden golden("enss_x2_table");
    const std::vector<float> alpha = noise(static_cast<size_t>(golden.render.width) * golden.render.height);
    UpscalerOptions linear;
    linear.color_space = ColorSpace::linear;
    CHECK(channel(upscaled(golden, with_alpha(linear), alpha)[0], 4, 3) ==
          channel(upscaled(golden, with_alpha(), alpha)[0], 4, 3));
    UpscalerOptions without = with_alpha();
    without.alpha = false;
    for (const float value : channel(upscaled(golden, without, alpha)[0], 4, 3)) CHECK(value == 1);
}

TEST_CASE("alpha of halves is that of floats to within a half's steps" * doctest::test_suite("golden")) {
    const Golden golden("enss_x2_table");
    const std::vector<float> alpha = noise(static_cast<size_t>(golden.render.width) * golden.render.height);
    UpscalerOptions options = with_alpha();
    const std::vector<float> expected = channel(upscaled(golden, options, alpha)[0], 4, 3);
    options.precision = Precision::fp16;
    const std::vector<float> made = channel(upscaled(golden, options, alpha)[0], 4, 3);
    for (size_t i = 0; i < made.size(); ++i) CHECK(std::abs(made[i] - expected[i]) < 2e-3f);
}

namespace {

/// A frame of noise through an upscaler of four channels.
std::vector<float> frame_through(Upscaler& upscaler, Size render, const std::vector<float>& color) {
    const Size size = upscaler.output_size(render);
    std::vector<float> output(4 * static_cast<size_t>(size.width) * size.height);
    FrameDescription frame;
    frame.render_size = render;
    frame.jitter = {0.25f, -0.125f};
    frame.color = {.host = const_cast<float*>(color.data()), .size = render};
    frame.output = {.host = output.data(), .size = size};
    upscaler.submit(frame).wait();
    return output;
}

}  // namespace

TEST_CASE("a device that does not see colour makes alpha") {
    const Size size{14, 9};
    const std::vector<float> color = noise(4 * static_cast<size_t>(size.width) * size.height);
    const Model model = Model::filter("bicubic", 2);
    Upscaler alone(test_device(), model, size, with_alpha());
    UpscalerOptions options = with_alpha();
    options.placement = "alpha*=1";
    Upscaler cut(Device::together({test_device(), test_device()}), model, size, options);
    CHECK(cut.placement().size() > 1);
    CHECK(frame_through(cut, size, color) == frame_through(alone, size, color));
}

TEST_CASE("alpha of frames that are rendered smaller") {
    const Size largest{16, 12}, smaller{12, 9}, output{32, 24};
    UpscalerOptions options = with_alpha();
    options.output_size = output;
    const Model model = Model::filter("bicubic", 2);
    const std::vector<float> color = noise(4 * static_cast<size_t>(smaller.width) * smaller.height);
    Upscaler of_that_size(test_device(), model, smaller, options);
    options.dynamic_resolution = true;
    Upscaler dynamic(test_device(), model, largest, options);
    frame_through(dynamic, largest, noise(4 * static_cast<size_t>(largest.width) * largest.height));
    const std::vector<float> made = frame_through(dynamic, smaller, color);
    const std::vector<float> expected = frame_through(of_that_size, smaller, color);
    REQUIRE(made.size() == expected.size());
    for (size_t i = 0; i < made.size(); ++i) CHECK(std::abs(made[i] - expected[i]) <= kClose);
}

TEST_CASE("user interface covers what alpha leaves open") {
    const Golden golden("srpo_x2");
    const std::vector<float> alpha = noise(static_cast<size_t>(golden.render.width) * golden.render.height);
    const std::vector<float> below = upscaled(golden, with_alpha(), alpha)[0];
    std::vector<float> ui = noise(below.size()), color;
    for (size_t i = 0; i < ui.size(); ++i)
        if (i % 4 != 3) ui[i] *= ui[i / 4 * 4 + 3];
    UpscalerOptions options = with_alpha();
    options.ui_format = ImageFormat{ElementType::f32, 4};
    const std::vector<float> drawn = run(golden, options, 1, [&](int, FrameDescription& frame) {
                                         color = interleaved(frame, alpha);
                                         frame.color.host = color.data();
                                         frame.ui = {.host = ui.data(), .size = frame.output.size};
                                     }).outputs[0];
    for (size_t i = 0; i < drawn.size(); ++i)
        CHECK(drawn[i] == doctest::Approx(ui[i] + (1 - ui[i / 4 * 4 + 3]) * below[i]).epsilon(1e-5));
}

TEST_SUITE("small") {
    TEST_CASE("alpha wants a place in colour and output") {
        UpscalerOptions options = with_alpha();
        options.color_format.channels = 3;
        CHECK(message(options) == "options.alpha: color_format has 3 channels; alpha is the fourth");
        options = with_alpha();
        options.output_format.channels = 3;
        CHECK(message(options) == "options.alpha: output_format has 3 channels; with alpha it has 4");
    }

    TEST_CASE("alpha that is no number is 0, in bytes as in floats") {
        const Size size{3, 2};
        std::vector<float> color(24, 0.5f), output(24);
        for (int i = 0; i < 6; ++i) color[4 * i + 3] = i % 2 ? std::nanf("") : 7.0f;
        Upscaler upscaler(test_device(), Model::filter("nearest", 1), size, with_alpha());
        FrameDescription frame;
        frame.color = {.host = color.data(), .size = size};
        frame.output = {.host = output.data(), .size = size};
        upscaler.submit(frame).wait();
        for (int i = 0; i < 6; ++i) CHECK(output[4 * i + 3] == (i % 2 ? 0.0f : 1.0f));

        std::vector<uint8_t> bytes(24, 255), shown(24);
        for (int i = 0; i < 6; ++i) bytes[4 * i + 3] = static_cast<uint8_t>(40 * i);
        UpscalerOptions options = with_alpha();
        options.color_format.type = options.output_format.type = ElementType::u8;
        Upscaler of_bytes(test_device(), Model::filter("nearest", 1), size, options);
        frame.color.host = bytes.data();
        frame.output.host = shown.data();
        of_bytes.submit(frame).wait();
        CHECK(shown == bytes);
    }

    TEST_CASE("alpha of two bits, in rows with gaps") {
        const Size size{2, 2};
        constexpr uint32_t whites = 0x3fffffff;
        const std::vector<uint32_t> color{whites | 0u << 30, whites | 1u << 30, 7,
                                          whites | 2u << 30, whites | 3u << 30, 7};
        std::vector<float> output(16);
        UpscalerOptions options = with_alpha();
        options.color_format.type = ElementType::rgb10a2;
        Upscaler upscaler(test_device(), Model::filter("nearest", 1), size, options);
        FrameDescription frame;
        frame.color = {.host = const_cast<uint32_t*>(color.data()), .row_pitch = 12, .size = size};
        frame.output = {.host = output.data(), .size = size};
        upscaler.submit(frame).wait();
        for (int i = 0; i < 4; ++i) CHECK(std::abs(output[4 * i + 3] - static_cast<float>(i) / 3) < kClose);
    }
}
