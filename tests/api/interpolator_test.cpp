#include "clarus/interpolator.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "clarus/error.h"
#include "test_device.h"

using namespace clarus;

namespace {

const Size kRender{40, 28}, kOutput{80, 56};

using Picture = std::vector<float>;

/// A texture whose colours at whole pixels are all different, at a place that moves.
Picture picture(const std::function<float(int x, int y)>& value) {
    Picture result(3 * kOutput.width * kOutput.height);
    for (int y = 0; y < kOutput.height; ++y)
        for (int x = 0; x < kOutput.width; ++x)
            for (int c = 0; c < 3; ++c)
                result[3 * (y * kOutput.width + x) + c] = std::fmod(value(x, y) + 0.3f * static_cast<float>(c), 1.0f);
    return result;
}

float noise(int x, int y) {
    const uint32_t mixed =
        (static_cast<uint32_t>(x + 1000) * 73856093u) ^ (static_cast<uint32_t>(y + 1000) * 19349663u);
    return static_cast<float>((mixed * 2654435761u) >> 8) / 16777216.0f;
}

struct Geometry {
    std::vector<float> depth = std::vector<float>(kRender.width * kRender.height, 0.5f);
    std::vector<float> motion = std::vector<float>(2 * kRender.width * kRender.height, 0.0f);

    void set(int x, int y, Vec2 vector, float distance) {
        depth[y * kRender.width + x] = distance;
        motion[2 * (y * kRender.width + x)] = vector.x;
        motion[2 * (y * kRender.width + x) + 1] = vector.y;
    }
};

Geometry moving(Vec2 vector) {
    Geometry result;
    for (int y = 0; y < kRender.height; ++y)
        for (int x = 0; x < kRender.width; ++x) result.set(x, y, vector, 0.5f);
    return result;
}

Picture submit(Interpolator& interpolator, Picture color, Geometry geometry, bool reset = false, Vec2 jitter = {}) {
    Picture output(color.size(), -1.0f);
    FrameDescription frame;
    frame.color = {.host = color.data(), .size = kOutput};
    frame.depth = {.host = geometry.depth.data(), .size = kRender};
    frame.motion = {.host = geometry.motion.data(), .size = kRender};
    frame.jitter = jitter;
    frame.reset = reset;
    frame.output = {.host = output.data(), .size = kOutput};
    interpolator.submit(frame).wait();
    return output;
}

Interpolator interpolator() { return {test_device(), kRender, kOutput}; }

float at(const Picture& image, int x, int y) { return image[3 * (y * kOutput.width + x)]; }

}  // namespace

TEST_CASE("a still picture stays what it is") {
    Interpolator between = interpolator();
    const Picture still = picture(noise);
    CHECK(submit(between, still, {}) == still);
    for (const Vec2 jitter : {Vec2{0.25f, -0.375f}, Vec2{-0.5f, 0.125f}})
        CHECK(submit(between, still, {}, false, jitter) == still);
}

TEST_CASE("a flat picture stays what it is, however it moves") {
    Interpolator between = interpolator();
    const Picture flat = picture([](int, int) { return 0.6f; });
    submit(between, flat, {});
    const Picture result = submit(between, flat, moving({1.3f, -0.7f}), false, {0.25f, 0.125f});
    for (size_t i = 0; i < flat.size(); ++i) CHECK(result[i] == doctest::Approx(flat[i]).epsilon(1e-6));
}

TEST_CASE("a texture that moves by whole pixels is exact in between") {
    Interpolator between = interpolator();
    // Four output pixels to the right and two up, so that in between it is two and one.
    const auto shown = [](int shift_x, int shift_y) {
        return picture([=](int x, int y) { return noise(x - shift_x, y + shift_y); });
    };
    submit(between, shown(0, 0), {});
    const Picture result = submit(between, shown(4, 2), moving({-2, 1}), false, {0.25f, -0.125f});
    const Picture truth = shown(2, 1);
    for (int y = 4; y < kOutput.height - 4; ++y)
        for (int x = 4; x < kOutput.width - 4; ++x) CHECK(at(result, x, y) == at(truth, x, y));
    // At the border only one of both shows what is there.
    for (int y = 1; y < kOutput.height - 1; ++y) {
        CHECK(at(result, 0, y) == at(truth, 0, y));
        CHECK(at(result, kOutput.width - 1, y) == at(truth, kOutput.width - 1, y));
    }
}

TEST_CASE("what one neighbour hides comes from the other") {
    // A near dark square moves eight output pixels to the right before a far bright wall that moves two to the left.
    const auto scene = [](int square, int wall) {
        return picture([=](int x, int y) {
            const bool is_near = x >= square && x < square + 24 && y >= 16 && y < 40;
            return is_near ? 0.05f * noise(x - square, y) : 0.55f + 0.1f * noise(x - wall, y);
        });
    };
    Geometry geometry;
    for (int y = 0; y < kRender.height; ++y)
        for (int x = 0; x < kRender.width; ++x) {
            const bool is_near = x >= 16 && x < 28 && y >= 8 && y < 20;
            geometry.set(x, y, {is_near ? -4.0f : 1.0f, 0}, is_near ? 0.2f : 0.8f);
        }
    Interpolator between = interpolator();
    submit(between, scene(24, 2), {});
    const Picture result = submit(between, scene(32, 0), geometry), truth = scene(28, 1);
    int wrong = 0;
    for (int y = 2; y < kOutput.height - 2; ++y)
        for (int x = 2; x < kOutput.width - 2; ++x) {
            // Silhouettes are known to one render pixel.
            const auto beside = [](int value, int edge) { return value >= edge - 2 && value < edge + 2; };
            const bool at_edge = beside(x, 28) || beside(x, 52) || beside(y, 16) || beside(y, 40);
            if (!at_edge && std::abs(at(result, x, y) - at(truth, x, y)) > 0.06f) ++wrong;
        }
    CHECK(wrong == 0);
    // Uncovered since the previous frame, and still covered in it: as this frame shows it; going to be hidden: as the
    // previous one does.
    CHECK(at(result, 25, 28) > 0.5f);
    CHECK(at(result, 54, 28) > 0.5f);
    CHECK(at(result, 40, 28) < 0.1f);
}

TEST_CASE("a reset repeats the frame that follows") {
    Interpolator between = interpolator();
    const Picture before = picture(noise), after = picture([](int x, int y) { return noise(y, x); });
    CHECK(submit(between, before, moving({3, 0})) == before);
    CHECK(submit(between, after, moving({3, 0}), true) == after);
    between.reset();
    CHECK(submit(between, before, moving({3, 0})) == before);
}

TEST_CASE("without a valid vector both neighbours are shown") {
    Interpolator between = interpolator();
    const Picture before = picture(noise), after = picture([](int x, int y) { return noise(y, x); });
    submit(between, before, {});
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const Picture result = submit(between, after, moving({nan, nan}));
    for (size_t i = 0; i < result.size(); ++i)
        CHECK(result[i] == doctest::Approx(0.5f * (before[i] + after[i])).epsilon(1e-6));
}

TEST_CASE("interpolation gives the same picture every time") {
    std::mt19937 random(5);
    std::uniform_real_distribution<float> unit(0, 1), far(-6, 6);
    Geometry geometry;
    for (float& value : geometry.depth) value = std::floor(4 * unit(random)) / 4;
    for (float& value : geometry.motion) value = far(random);
    const Picture before = picture(noise), after = picture([](int x, int y) { return noise(y, x); });
    Interpolator between = interpolator();
    submit(between, before, {});
    const Picture first = submit(between, after, geometry);
    for (int i = 0; i < 5; ++i) {
        submit(between, before, {}, true);
        CHECK(submit(between, after, geometry) == first);
    }
}

TEST_CASE("an interpolator names what is wrong") {
    const auto refused = [](Size render, Size output, const std::string& named) {
        CHECK_THROWS_WITH_AS(Interpolator(test_device(), render, output), doctest::Contains(named.c_str()), Error);
    };
    refused({40, 28}, {39, 28}, "39x28");
    refused({40, 28}, {80, 84}, "80x84");
    refused({0, 28}, {80, 56}, "0x28");
    refused({40, 28}, {80000, 56000}, "80000x56000");
    Interpolator between = interpolator();
    FrameDescription frame;
    Picture color(3 * kOutput.width * kOutput.height);
    frame.color = {.host = color.data(), .size = kRender};
    CHECK_THROWS_WITH_AS(between.submit(frame), doctest::Contains("frame.color: 40x28"), Error);
    frame.color.size = kOutput;
    CHECK_THROWS_WITH_AS(between.submit(frame), doctest::Contains("frame.depth"), Error);
}
