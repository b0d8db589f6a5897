#include <doctest/doctest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>

#include "clarus/jitter.h"
#include "metrics/display.h"
#include "render/worlds/world.h"
#include "render_harness.h"

using namespace clarus;
using namespace clarus::render;
using namespace clarus::render_test;

namespace {

/// Bilinear, at a pixel position inside the image.
float at_position(const io::Pixels& image, double x, double y, int channel) {
    x = std::clamp(x - 0.5, 0.0, image.size.width - 1.0);
    y = std::clamp(y - 0.5, 0.0, image.size.height - 1.0);
    const int left = std::min(static_cast<int>(x), image.size.width - 2);
    const int top = std::min(static_cast<int>(y), image.size.height - 2);
    const double fx = x - left, fy = y - top;
    const auto row = [&](int j) { return image.at(left, j, channel) * (1 - fx) + image.at(left + 1, j, channel) * fx; };
    return static_cast<float>(row(top) * (1 - fy) + row(top + 1) * fy);
}

/// The mean of 16 jittered frames against the reference's means of 2 by 2 pixels, in dB.
double quality_of_mean(Scene& scene, const FrameState& still, float mip_bias) {
    RenderSettings settings = small_settings();
    settings.render_size = {96, 54};
    settings.output_size = {192, 108};
    settings.hdr = true;
    settings.mip_bias = mip_bias;
    io::Pixels mean{settings.render_size, 3, std::vector<float>(96 * 54 * 3)};
    constexpr int points = 16;
    for (int i = 0; i < points; ++i) {
        const RenderedFrame frame = render_frame(scene, still, halton_jitter(i, points), settings);
        for (size_t k = 0; k < mean.values.size(); ++k) mean.values[k] += frame.color.values[k] / points;
    }
    settings.reference_grid = 4;
    const io::Pixels reference = pooled(render_frame(scene, still, {}, settings).reference, 2);
    const auto displayed = [](const io::Pixels& image) { return metrics::display_values(image, ColorSpace::linear); };
    return psnr(displayed(mean), displayed(reference));
}

}  // namespace

TEST_CASE("the reference before, warped by the motion vectors, is the reference now, but for what was hidden") {
    const auto scene = smooth_scene();
    RenderSettings settings = small_settings();
    settings.render_size = {96, 64};
    settings.output_size = {192, 128};
    settings.reference_grid = 4;
    settings.output_buffers = true;
    CameraPose before = in_front(5), now{{0.07, -0.04, 4.98}, 0.012, 0.008, 0.01, 1};
    const RenderedFrame first = render_frame(*scene, {before, before, 0.9, 0.9}, {}, settings);
    const RenderedFrame second = render_frame(*scene, {now, before, 1, 0.9}, {}, settings);

    const auto [width, height] = settings.output_size;
    double squares = 0, still_squares = 0;
    int compared = 0, hidden = 0;
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            const double px = x + 0.5 + 2 * second.output_motion.at(x, y, 0);
            const double py = y + 0.5 + 2 * second.output_motion.at(x, y, 1);
            if (px < 0.5 || py < 0.5 || px > width - 0.5 || py > height - 0.5) continue;
            // Depths differ by centimetres from frame to frame, by metres between ball and wall: where one of the four
            // pixels that are looked at shows the other, the place was hidden, or is an edge.
            const auto depth = [&](int i, int j) {
                return first.output_depth.at(std::clamp(i, 0, width - 1), std::clamp(j, 0, height - 1), 0);
            };
            const int left = static_cast<int>(px - 0.5), top = static_cast<int>(py - 0.5);
            bool same = true;
            for (int i = -1; i < 3; ++i) {
                for (int j = -1; j < 3; ++j) {
                    const float difference = depth(left + i, top + j) - second.output_depth.at(x, y, 0);
                    same &= std::abs(difference) * settings.far_plane < 0.3f;
                }
            }
            if (!same) {
                ++hidden;
                continue;
            }
            for (int channel = 0; channel < 3; ++channel) {
                const double value = second.reference.at(x, y, channel);
                squares += std::pow(value - at_position(first.reference, px, py, channel), 2);
                still_squares += std::pow(value - first.reference.at(x, y, channel), 2);
                ++compared;
            }
        }
    }
    const double warped = -10 * std::log10(squares / compared), still = -10 * std::log10(still_squares / compared);
    MESSAGE("warped ", warped, " dB, not warped ", still, " dB, ", hidden, " pixels left out");
    CHECK(compared > 3 * 0.8 * width * height);
    CHECK(hidden > 50);
    CHECK(warped > 35);
    CHECK(still < 30);
}

TEST_CASE("the jittered frames of a still scene average to the reference") {
    // A ball and bars with sharp edges in front of a wall.
    auto scene = std::make_unique<Scene>();
    scene->environment = even_light();
    scene->add_static({square(scene->add_material({.texture = smooth(0.3f)}), 6)});
    Mesh things{.material = scene->add_material({.texture = smooth(1.1f)})};
    things.add_sphere({-1.5f, 0.3f, 1}, 1, 48, 4);
    for (int i = 0; i < 5; ++i) {
        const float x = 0.4f * static_cast<float>(i);
        things.add_cylinder({x, -1.5f, 1}, {x + 0.5f, 1.5f, 1}, 0.05f, 0.05f, 12, 0.5f);
    }
    scene->add_static({things});
    scene->build();
    // At −3 a colour sample's share of a pixel is that of a reference sample; −1 is what docs/conventions.md, "Jitter",
    // has at ×2. The textures' waves are so long that either shows them as they are.
    for (const float mip_bias : {-3.0f, -1.0f}) {
        CAPTURE(mip_bias);
        const double quality = quality_of_mean(*scene, {in_front(5), in_front(5)}, mip_bias);
        CHECK(quality > 40);
        MESSAGE("edges at mip bias ", mip_bias, ": ", quality, " dB");
    }

    // The demo has an edge in nearly every pixel, so that 16 samples are not yet its mean.
    const World demo = make_world("demo", 1);
    const FrameState still = demo.frame(25);
    CHECK(still.camera.position == still.previous_camera.position);
    CHECK(still.seconds == still.previous_seconds);
    const double quality_of_demo = quality_of_mean(*demo.scene, still, -3);
    CHECK(quality_of_demo > 33);
    MESSAGE("demo ", quality_of_demo, " dB");
}

TEST_CASE("the same frame has the same values every time, with any number of threads") {
    const auto render = [] {
        const World world = make_world("demo", 4);
        RenderSettings settings = small_settings();
        settings.reference_grid = 1;
        settings.output_buffers = true;
        return render_frame(*world.scene, world.frame(3), halton_jitter(3, 16), settings);
    };
    const RenderedFrame first = render();
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    const RenderedFrame again = render();
    for (const auto image : {&RenderedFrame::color, &RenderedFrame::depth, &RenderedFrame::motion,
                             &RenderedFrame::reference, &RenderedFrame::aliased, &RenderedFrame::output_motion})
        CHECK((first.*image).values == (again.*image).values);
}
