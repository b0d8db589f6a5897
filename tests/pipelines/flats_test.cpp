#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "clarus/jitter.h"
#include "clarus/upscaler.h"
#include "test_device.h"

using namespace clarus;

namespace {

constexpr Size kRender{48, 40};
constexpr int kBar = 8, kReach = 3;  // render pixels

/// A still camera's frames of colour, before a wall: depth ½, no motion.
class Stream {
  public:
    Stream(const Model& model, ColorSpace color_space)
        : upscaler_(test_device(), model, kRender, options(color_space)),
          depth_(static_cast<size_t>(kRender.width) * kRender.height, 0.5f),
          motion_(2 * depth_.size(), 0.f),
          scale_(model.scale()),
          mnss_(model.pipeline() == "mnss") {}

    /// The output, 3 channels. `color(c, x, y)` at render resolution.
    std::vector<float> show(const std::function<float(int, int, int)>& color) {
        std::vector<float> input(3 * depth_.size());
        for (size_t i = 0; i < input.size(); ++i) {
            const int pixel = static_cast<int>(i / 3);
            input[i] = color(static_cast<int>(i % 3), pixel % kRender.width, pixel / kRender.width);
        }
        const Size size = upscaler_.output_size();
        std::vector<float> output(static_cast<size_t>(3) * size.width * size.height);
        FrameDescription frame;
        frame.color = {.host = input.data(), .size = kRender};
        frame.depth = {.host = depth_.data(), .size = kRender};
        frame.motion = {.host = motion_.data(), .size = kRender};
        frame.jitter = mnss_ ? mnss_jitter(shown_, static_cast<int>(scale_)) : halton_jitter(shown_, 16);
        ++shown_;
        frame.output = {.host = output.data(), .size = size};
        upscaler_.submit(frame).wait();
        return output;
    }

    Size output_size() const { return upscaler_.output_size(); }

  private:
    static UpscalerOptions options(ColorSpace color_space) {
        UpscalerOptions result;
        result.color_space = color_space;
        return result;
    }

    Upscaler upscaler_;
    std::vector<float> depth_, motion_;
    double scale_;
    bool mnss_;  // what it was trained with
    int shown_ = 0;
};

using Level = std::function<float(int, int)>;  // of an output pixel

/// The largest distance of any channel from `level`, border and all.
float distance(const std::vector<float>& output, Size size, const Level& level) {
    float most = 0;
    for (int y = 0; y < size.height; ++y) {
        for (int x = 0; x < size.width; ++x) {
            for (int c = 0; c < 3; ++c) {
                const float value = output[3 * (static_cast<size_t>(y) * size.width + x) + c];
                most = std::max(most, std::isfinite(value) ? std::abs(value - level(x, y)) : HUGE_VALF);
            }
        }
    }
    return most;
}

/// Fine and saturated, as leaves and print are.
std::function<float(int, int, int)> textured() {
    std::mt19937 random(5);
    std::vector<float> values(static_cast<size_t>(3) * kRender.width * kRender.height);
    std::generate(values.begin(), values.end(), [&] { return static_cast<float>(random() % 256) / 255; });
    return [values](int c, int x, int y) { return values[3 * (static_cast<size_t>(y) * kRender.width + x) + c]; };
}

constexpr float kLevels = 2.f / 255;

float worst_flat(const Model& model, float level) {
    Stream stream(model, ColorSpace::srgb);
    float most = 0;
    for (int t = 0; t < 12; ++t) {
        const std::vector<float> output = stream.show([&](int, int, int) { return level; });
        most = std::max(most, distance(output, stream.output_size(), [&](int, int) { return level; }));
    }
    return most;
}

float worst_linear_flat(const Model& model, float radiance) {
    Stream stream(model, ColorSpace::linear);
    float most = 0;
    for (int t = 0; t < 12; ++t) {
        const std::vector<float> output = stream.show([&](int, int, int) { return radiance; });
        most = std::max(most, distance(output, stream.output_size(), [&](int, int) { return radiance; }));
    }
    return most / radiance;
}

/// What is left of the picture so many frames after a cut that nobody told.
float left_after_cut(const Model& model, float level, int frames) {
    Stream stream(model, ColorSpace::srgb);
    const auto picture = textured();
    for (int t = 0; t < 12; ++t) stream.show(picture);
    std::vector<float> output;
    for (int t = 0; t < frames; ++t) output = stream.show([&](int, int, int) { return level; });
    return distance(output, stream.output_size(), [&](int, int) { return level; });
}

/// In bars above and below, farther from the picture than any filter reaches: three render pixels.
float worst_bar(const Model& model) {
    Stream stream(model, ColorSpace::srgb);
    const auto picture = textured();
    const auto in_bar = [](double y) { return y < kBar || y >= kRender.height - kBar; };
    const Size size = stream.output_size();
    const double s = static_cast<double>(size.height) / kRender.height;
    float most = 0;
    for (int t = 0; t < 12; ++t) {
        std::vector<float> output = stream.show([&](int c, int x, int y) { return in_bar(y) ? 0 : picture(c, x, y); });
        for (int y = 0; y < size.height; ++y) {
            if (in_bar((y + 0.5) / s - kReach) && in_bar((y + 0.5) / s + kReach)) continue;
            std::fill_n(output.begin() + static_cast<size_t>(3) * y * size.width, 3 * size.width, 0.f);
        }
        most = std::max(most, distance(output, size, [](int, int) { return 0.f; }));
    }
    return most;
}

float worst_fade(const Model& model) {
    Stream stream(model, ColorSpace::srgb);
    float most = 0;
    for (int t = 0; t <= 24; ++t) {
        const float level = 1 - static_cast<float>(t) / 24;
        const std::vector<float> output = stream.show([&](int, int, int) { return level; });
        most = std::max(most, distance(output, stream.output_size(), [&](int, int) { return level; }));
    }
    return most;
}

/// Every shipped model and filter; those of any scale at whole ones, of which each has a network of its own, and
/// between.
void with_every_model(const std::function<void(const Model&)>& check) {
    for (const std::string& name : Model::names()) {
        const Model model = Model::find(name);
        std::vector<double> scales{model.scale()};
        if (!model.scales().is_single()) scales.insert(scales.end(), {1.5, 2.5, 3, 4});
        for (const double scale : scales) {
            CAPTURE(name);
            CAPTURE(scale);
            check(Model::find(name, scale));
        }
    }
}

}  // namespace

TEST_CASE("flat pictures stay flat with every shipped model and filter") {
    with_every_model([](const Model& model) {
        for (const float level : {0.f, 0.5f, 1.f}) CHECK(worst_flat(model, level) <= kLevels);
        for (const float radiance : {0.02f, 1.f, 100.f}) CHECK(worst_linear_flat(model, radiance) <= 0.02f);
    });
}

TEST_CASE("nothing is left of a picture four frames after a cut that nobody told") {
    with_every_model([](const Model& model) {
        for (const float level : {0.f, 1.f}) CHECK(left_after_cut(model, level, 4) <= kLevels);
    });
}

TEST_CASE("bars stay black, and a fade is seen as it is") {
    with_every_model([](const Model& model) {
        CHECK(worst_bar(model) <= kLevels);
        CHECK(worst_fade(model) <= kLevels);
    });
}
