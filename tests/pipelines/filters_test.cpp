#include <OpenImageIO/imagebuf.h>
#include <OpenImageIO/imagebufalgo.h>
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "clarus/upscaler.h"
#include "one_frame.h"
#include "test_device.h"

using namespace clarus;

namespace {

std::vector<float> filtered(const std::string& filter, double scale, Size render, const std::vector<float>& color,
                            Vec2 jitter = {}) {
    Upscaler upscaler(test_device(), Model::filter(filter, scale), render);
    return upscaled(upscaler, color, jitter);
}

std::vector<float> random_color(Size size) {
    std::mt19937 random(1);
    std::uniform_real_distribution<float> values(0.3f, 0.7f);  // so that no sum leaves [0, 1]
    std::vector<float> color(static_cast<size_t>(3) * size.width * size.height);
    for (float& value : color) value = values(random);
    return color;
}

}  // namespace

TEST_CASE("bicubic and Lanczos are OpenImageIO's away from the border") {
    const Size render{40, 30};
    const std::vector<float> color = random_color(render);
    const OIIO::ImageBuf source(OIIO::ImageSpec(render.width, render.height, 3, OIIO::TypeDesc::FLOAT),
                                const_cast<float*>(color.data()));
    for (const auto& [ours, theirs, radius] : {std::tuple{"bicubic", "catmull-rom", 2}, {"lanczos", "lanczos3", 3}}) {
        for (const double scale : {1.5, 2.0, 3.0}) {
            CAPTURE(ours);
            CAPTURE(scale);
            const std::vector<float> output = filtered(ours, scale, render, color);
            OIIO::ImageBuf resized;
            const Size size{static_cast<int>(scale * render.width), static_cast<int>(scale * render.height)};
            const float support = static_cast<float>(2 * radius * scale);  // in output pixels
            REQUIRE(
                OIIO::ImageBufAlgo::resize(resized, source, theirs, support, OIIO::ROI(0, size.width, 0, size.height)));
            float largest = 0;
            const int margin = static_cast<int>(std::ceil(scale * radius));
            for (int y = margin; y < size.height - margin; ++y) {
                for (int x = margin; x < size.width - margin; ++x) {
                    float pixel[3];
                    resized.getpixel(x, y, pixel, 3);
                    for (int c = 0; c < 3; ++c)
                        largest = std::max(largest, std::abs(pixel[c] - output[3 * (y * size.width + x) + c]));
                }
            }
            CHECK(largest < 1e-5f);
        }
    }
}

TEST_CASE("every filter of one frame keeps a constant, and at scale 1 without jitter the image") {
    const Size render{21, 13};
    const std::vector<float> noise = random_color(render), flat(noise.size(), 0.4f);
    for (const char* filter : {"nearest", "bilinear", "bicubic", "lanczos", "fsr1"}) {
        CAPTURE(std::string(filter));
        for (const double scale : {1.0, 1.5, 1.7, 2.0, 3.0, 6.0, 23.7})
            for (const float value : filtered(filter, scale, render, flat, {0.31f, -0.47f}))
                CHECK(value == doctest::Approx(0.4f).epsilon(1e-6));
        if (filter == std::string("fsr1")) continue;  // sharpens
        const std::vector<float> same = filtered(filter, 1, render, noise);
        for (size_t i = 0; i < noise.size(); ++i) CHECK(same[i] == doctest::Approx(noise[i]).epsilon(1e-6));
    }
}

TEST_CASE("filters put what they see where it was sampled") {
    // A ramp along x, sampled off the pixels' centres, comes out as the ramp at the output pixels' centres; but for
    // Lanczos, which ripples.
    const Size render{40, 9};
    const Vec2 jitter{0.3f, -0.2f};
    std::vector<float> color;
    for (int y = 0; y < render.height; ++y)
        for (int x = 0; x < render.width; ++x) color.insert(color.end(), 3, 0.02f * (x + 0.5f + jitter.x));
    for (const auto& [filter, tolerance] :
         {std::pair{"nearest", 0.011}, {"bilinear", 1e-6}, {"bicubic", 1e-6}, {"lanczos", 5e-4}}) {
        CAPTURE(std::string(filter));
        for (const double scale : {1.0, 1.5, 2.0, 3.0}) {
            const std::vector<float> output = filtered(filter, scale, render, color, jitter);
            const int width = static_cast<int>(std::lround(render.width * scale));
            for (int x = static_cast<int>(4 * scale); x < width - 4 * scale; ++x)
                CHECK(std::abs(output[3 * static_cast<size_t>(x)] - 0.02 * (x + 0.5) / scale) < tolerance);
        }
    }
}
