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

// Of fsr2, clarus and NSS, which keep what they gathered, and not what is shown.
TEST_CASE("a mask keeps what was before it out of the history behind it" * doctest::test_suite("golden")) {
    const auto difference_after = [](const Golden& golden, float mask) {
        const size_t pixels = static_cast<size_t>(golden.render.width) * golden.render.height;
        std::vector<float> other(3 * pixels), masked(pixels, mask);
        for (size_t i = 0; i < other.size(); ++i) other[i] = static_cast<float>(i % 7) / 7;
        UpscalerOptions options;
        options.reactive_format = kFloats;
        const auto behind = [&](bool begins_otherwise) {
            return shown(golden, options, [&, begins_otherwise](int t, FrameDescription& frame) {
                frame.reset = t == 0;
                if (t == 0 && begins_otherwise) frame.color.host = other.data();
                if (t == 1) frame.reactive_mask = image_of(masked, golden.render);
            })[2];
        };
        return largest_difference(behind(false), behind(true));
    };
    Golden golden("enss_x2_table");
    golden.model = Model::filter("fsr2", 2);
    CHECK(difference_after(golden, 0) > 0.01f);
    CHECK(difference_after(golden, 1) < 1e-5f);
    const Golden clarus("clarus_x2");
    CHECK(difference_after(clarus, 0) > 0.01f);
    CHECK(difference_after(clarus, 1) < 1e-5f);
    // Its network saw the history, and chose by it what to take of the frame.
    const Golden nss("nss_x2");
    CHECK(difference_after(nss, 1) < 0.05f * difference_after(nss, 0));
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

TEST_CASE("of opaque colour a mask is made, where what is shown differs" * doctest::test_suite("golden")) {
    const Plain plains("enss_x2_table");
    const auto& [golden, plain, bicubic] = plains;
    const size_t pixels = static_cast<size_t>(golden.render.width) * golden.render.height;
    UpscalerOptions options;
    options.opaque_format = ImageFormat{ElementType::f32, 4};
    std::vector<float> opaque(4 * pixels);
    const auto with = [&](float difference) {
        return shown(golden, options, [&, difference](int, FrameDescription& frame) {
            const auto* color = static_cast<const float*>(frame.color.host);
            for (size_t i = 0; i < pixels; ++i)
                for (size_t c = 0; c < 3; ++c) {
                    const float value = color[3 * i + c];
                    opaque[4 * i + c] = c != 1 ? value : value > 0.5f ? value - difference : value + difference;
                }
            frame.opaque_color = image_of(opaque, golden.render);
        });
    };
    CHECK(with(0) == plain);
    CHECK(largest_difference(with(0.25f)[1], bicubic[1]) < 1e-4f);
    UpscalerOptions masked;
    masked.reactive_format = kFloats;
    std::vector<float> half(pixels, 0.5f);
    const Outputs expected = shown(
        golden, masked, [&](int, FrameDescription& frame) { frame.reactive_mask = image_of(half, golden.render); });
    CHECK(largest_difference(with(0.125f)[1], expected[1]) < 1e-4f);
    CHECK_THROWS_WITH_AS(shown(golden, options, [](int, FrameDescription&) {}), doctest::Contains("opaque_color: none"),
                         Error);
}

TEST_CASE("user interface is drawn over the output, and not kept" * doctest::test_suite("golden")) {
    const Golden golden("enss_x2_table");
    const Outputs plain = shown(golden, {}, [](int, FrameDescription&) {});
    const Size output{2 * golden.render.width, 2 * golden.render.height};
    const size_t pixels = static_cast<size_t>(output.width) * output.height;
    std::vector<uint8_t> ui(4 * pixels);
    for (size_t i = 0; i < pixels; i += 3) ui[4 * i] = 51, ui[4 * i + 3] = static_cast<uint8_t>(i % 2 ? 255 : 102);
    UpscalerOptions options;
    options.ui_format = ImageFormat{ElementType::u8, 4};
    const Outputs drawn = shown(golden, options, [&](int t, FrameDescription& frame) {
        if (t < 2) frame.ui = {.host = ui.data(), .size = output};
    });
    for (int t = 0; t < 2; ++t) {
        std::vector<float> expected = plain[t];
        for (size_t i = 0; i < 3 * pixels; ++i) {
            const float alpha = static_cast<float>(ui[4 * (i / 3) + 3]) / 255;
            expected[i] = static_cast<float>(ui[4 * (i / 3) + i % 3]) / 255 + (1 - alpha) * expected[i];
        }
        CHECK(largest_difference(drawn[t], expected) < 1e-6f);
    }
    CHECK(drawn[2] == plain[2]);
}

TEST_CASE("user interface is drawn over sizes of every kind, and refused where it cannot be" *
          doctest::test_suite("small")) {
    const Size size{6, 5};
    std::vector<float> color(90, 0.5f);
    UpscalerOptions options;
    options.ui_format = ImageFormat{ElementType::f32, 4};
    for (const Size output : {Size{12, 10}, Size{6, 9}, Size{3, 4}, Size{13, 5}}) {
        CAPTURE(output.width);
        const size_t pixels = static_cast<size_t>(output.width) * output.height;
        std::vector<float> ui(4 * pixels, 0.0f), shown(3 * pixels);
        for (const size_t i : {size_t{0}, pixels - 1}) ui[4 * i + 1] = ui[4 * i + 3] = 1;
        options.output_size = output;
        Upscaler upscaler(test_device(), Model::filter("bilinear", 2), size, options);
        FrameDescription frame;
        frame.color = image_of(color, size);
        frame.output = image_of(shown, output);
        frame.ui = image_of(ui, output);
        upscaler.submit(frame).wait();
        for (size_t i = 0; i < pixels; ++i) {
            const bool covered = i == 0 || i == pixels - 1;
            CHECK(shown[3 * i] == doctest::Approx(covered ? 0 : 0.5));
            CHECK(shown[3 * i + 1] == doctest::Approx(covered ? 1 : 0.5));
        }
        frame.ui.size = {1, 1};
        CHECK_THROWS_WITH_AS(upscaler.submit(frame), doctest::Contains("frame.ui"), Error);
    }
    const auto refuse = [&](const char* words) {
        CHECK_THROWS_WITH_AS(Upscaler(test_device(), Model::filter("bilinear", 2), size, options),
                             doctest::Contains(words), Error);
    };
    options.color_space = ColorSpace::linear;
    refuse("options.ui_format: user interface");
    options.ui_format->channels = 3;
    refuse("options.ui_format");
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
