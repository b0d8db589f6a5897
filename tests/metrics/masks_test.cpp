#include "metrics/masks.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <random>

#include "clarus/error.h"

using clarus::Size;
using clarus::io::GroundTruth;
using clarus::io::Pixels;
namespace metrics = clarus::metrics;
using metrics::Mask;
using metrics::MaskMaker;
using metrics::Masks;
using metrics::Region;

namespace {

Pixels filled(Size size, int channels, float value) {
    return {size, channels, std::vector<float>(static_cast<size_t>(size.width) * size.height * channels, value)};
}

int count(const Mask& mask) { return static_cast<int>(std::count(mask.begin(), mask.end(), 1)); }

// A box in front of a wall; both move evenly, and all of it may go farther away. What is where follows from that.
struct BoxAndWall {
    Size size;
    double left, top, width, height;      // the box, in frame 0, in output pixels
    double box_x, box_y, wall_x, wall_y;  // pixels a frame
    float box_depth = 0.25f, wall_depth = 0.5f, receding = 0;

    bool in_box(double x, double y, int frame, double grown = 0) const {
        x -= left + box_x * frame - grown;
        y -= top + box_y * frame - grown;
        return x >= 0 && y >= 0 && x < width + 2 * grown && y < height + 2 * grown;
    }

    GroundTruth truth(int frame) const {
        GroundTruth truth{filled(size, 1, 0), filled(size, 2, 0)};
        for (int y = 0; y < size.height; ++y)
            for (int x = 0; x < size.width; ++x) {
                const bool box = in_box(x + 0.5, y + 0.5, frame);
                truth.depth.at(x, y, 0) = (box ? box_depth : wall_depth) + receding * frame;
                truth.motion.at(x, y, 0) = static_cast<float>(-(box ? box_x : wall_x));
                truth.motion.at(x, y, 1) = static_cast<float>(-(box ? box_y : wall_y));
            }
        return truth;
    }

    // Whether what is at a pixel was behind the box, or outside, in any of so many frames before: the definition.
    bool disoccluded(int x, int y, int frame, int frames, double grown = 0) const {
        const bool box = in_box(x + 0.5, y + 0.5, frame, grown);
        for (int k = 1; k <= std::min(frames, frame); ++k) {
            const double i = x + 0.5 - k * (box ? box_x : wall_x), j = y + 0.5 - k * (box ? box_y : wall_y);
            if (i < 0 || j < 0 || i > size.width || j > size.height) return true;
            if (!box && in_box(i, j, frame - k, grown)) return true;
        }
        return false;
    }
};

const std::array<std::pair<Region, int>, 3> histories{
    {{Region::disoccluded_1, 1}, {Region::disoccluded_4, 4}, {Region::disoccluded_8, 8}}};

}  // namespace

TEST_CASE("disoccluded is what a moving box uncovers, and what comes into the picture") {
    for (const BoxAndWall& scene : {BoxAndWall{{61, 23}, 3, 5, 12, 9, 3, 0, 0, 0},
                                    BoxAndWall{{47, 41}, 8, 30, 11, 8, 2, -3, 0, 0},   // leaves the picture
                                    BoxAndWall{{53, 19}, -30, 4, 20, 10, 5, 0, 0, 0},  // enters it
                                    BoxAndWall{{45, 33}, 10, 10, 9, 9, 1, 1, -2, 1},   // before a wall that passes
                                    BoxAndWall{{45, 33}, 10, 10, 9, 9, 1, 1, 1, 1},    // with it
                                    BoxAndWall{{50, 21}, 3, 5, 12, 9, 3, 0, 0, 0, 0.1f, 0.2f, 0.02f}}) {
        MaskMaker maker(2);
        for (int frame = 0; frame < 13; ++frame) {
            const Masks masks = maker.add(scene.truth(frame), frame > 0);
            for (const auto& [region, frames] : histories)
                for (int y = 0; y < scene.size.height; ++y)
                    for (int x = 0; x < scene.size.width; ++x) {
                        INFO("frame ", frame, ", the last ", frames, ", pixel ", x, ", ", y);
                        REQUIRE(masks[region][y * scene.size.width + x] == scene.disoccluded(x, y, frame, frames));
                    }
        }
    }
}

TEST_CASE("disoccluded follows motion between pixels") {
    const BoxAndWall scene{{67, 37}, 6, 9, 17, 13, 1.37, 0.61, -0.43, 0.29};
    MaskMaker maker(2);
    int compared = 0, found = 0;
    for (int frame = 0; frame < 16; ++frame) {
        const Masks masks = maker.add(scene.truth(frame), frame > 0);
        for (const auto& [region, frames] : histories)
            for (int y = 2; y < scene.size.height - 8; ++y)
                for (int x = 2; x < scene.size.width - 8; ++x) {
                    // Where a pixel more or less of the box would make it another answer, either is right.
                    const bool least = scene.disoccluded(x, y, frame, frames, -1),
                               most = scene.disoccluded(x, y, frame, frames, 1);
                    if (least != most ||
                        scene.in_box(x + 0.5, y + 0.5, frame, -1) != scene.in_box(x + 0.5, y + 0.5, frame, 1))
                        continue;
                    INFO("frame ", frame, ", the last ", frames, ", pixel ", x, ", ", y);
                    REQUIRE(masks[region][y * scene.size.width + x] == least);
                    ++compared;
                    found += least;
                }
    }
    CHECK(compared > 50000);
    CHECK(found > 300);
}

TEST_CASE("a camera that backs away uncovers nothing of a floor") {
    // Rows of a floor at growing distance that all recede by a tenth of the nearest.
    const auto floor = [](int frame) {
        GroundTruth truth{filled({40, 32}, 1, 0), filled({40, 32}, 2, 0)};
        for (int y = 0; y < 32; ++y)
            for (int x = 0; x < 40; ++x)
                truth.depth.at(x, y, 0) = 0.02f + 0.0001f * static_cast<float>(31 - y) + 0.002f * frame;
        return truth;
    };
    MaskMaker maker(2);
    maker.add(floor(0), false);
    CHECK(count(maker.add(floor(1), true)[Region::disoccluded_1]) == 0);
}

TEST_CASE("without a predecessor nothing is known but what is thin") {
    const BoxAndWall scene{{30, 20}, 5, 5, 2, 10, 2, 0, 0, 0};
    MaskMaker maker(2);
    for (const bool follows : {false, true, false}) {
        const Masks masks = maker.add(scene.truth(follows ? 1 : 0), follows);
        CHECK(count(masks[Region::thin]) == 4 * 12);
        for (const Region region : {Region::disoccluded_1, Region::disoccluded_8, Region::moving, Region::still})
            CHECK((count(masks[region]) > 0) ==
                  (follows && region != Region::still) * 1 + (follows && region == Region::still));
    }
}

TEST_CASE("an invalid vector has no history, one out of the image neither") {
    const float nan = std::numeric_limits<float>::quiet_NaN(), infinity = std::numeric_limits<float>::infinity();
    GroundTruth truth{filled({7, 1}, 1, 0.5f), filled({7, 1}, 2, 0)};
    MaskMaker maker(2);
    maker.add(truth, false);
    truth.motion.values = {nan, 0, 0, nan, infinity, 0, -4, 0, -4.5f, 0, 0, 0, 0, 0.6f};
    const Masks masks = maker.add(truth, true);
    CHECK(masks[Region::disoccluded_1] == Mask{1, 1, 1, 1, 0, 0, 1});
    CHECK(masks[Region::still] == Mask{0, 0, 0, 0, 0, 1, 0});
    CHECK(masks[Region::moving][0] + masks[Region::moving][1] == 0);
    CHECK(masks[Region::moving][4] == 1);
}

TEST_CASE("moving and still are told apart in render pixels") {
    GroundTruth truth{filled({1, 1}, 1, 0.5f), filled({1, 1}, 2, 0)};
    for (const double scale : {1.0, 1.5, 3.0})
        for (const float share : {0.0f, 0.06f, 0.065f, 0.49f, 0.51f}) {
            MaskMaker maker(scale);
            maker.add(truth, false);
            GroundTruth now = truth;
            now.motion.values = {0, static_cast<float>(share * scale) * -1};
            // Half an output pixel leads out of an image of one pixel.
            const bool seen = share * scale <= 0.5;
            const Masks masks = maker.add(now, true);
            CHECK(masks[Region::disoccluded_1][0] == !seen);
            CHECK(masks[Region::still][0] == (share < 0.0625f));
            CHECK(masks[Region::moving][0] == (share >= 0.5f));
        }
}

TEST_CASE("thin is a wire narrower than two render pixels, with its neighbours") {
    for (int width = 1; width < 7; ++width)
        for (const bool upright : {true, false}) {
            Pixels depth = filled({21, 21}, 1, 0.5f);
            for (int i = 0; i < 21; ++i)
                for (int k = 8; k < 8 + width; ++k) (upright ? depth.at(k, i, 0) : depth.at(i, k, 0)) = 0.3f;
            Mask expected(21 * 21);
            for (int i = 0; i < 21 && width < 4; ++i)
                for (int k = 7; k < 9 + width; ++k) expected[upright ? i * 21 + k : k * 21 + i] = 1;
            CHECK_MESSAGE(metrics::thin_mask(depth, 2) == expected, width, upright);
            // A gap of that width is not thin, the wall beside it is not either.
            for (float& value : depth.values) value = 0.8f - value;
            CHECK(count(metrics::thin_mask(depth, 2)) == 0);
        }
    CHECK(count(metrics::thin_mask(filled({1, 1}, 1, 0.5f), 2)) == 0);
    // A floor that ends in the sky.
    Pixels floor = filled({9, 40}, 1, 1);
    for (int y = 5; y < 40; ++y)
        for (int x = 0; x < 9; ++x) floor.at(x, y, 0) = 0.1f / static_cast<float>(y - 3);
    CHECK(count(metrics::thin_mask(floor, 2)) == 0);
}

TEST_CASE("thin agrees with its definition") {
    std::mt19937 random(5);
    for (const Size size : {Size{1, 9}, Size{13, 9}, Size{24, 17}})
        for (const double scale : {1.0, 1.5, 2.0, 4.0}) {
            Pixels depth = filled(size, 1, 0);
            for (float& value : depth.values) value = random() % 4 ? 0.5f + 0.005f * (random() % 2) : 0.2f;
            const auto at = [&](int x, int y) { return depth.at(x, y, 0); };
            const auto is_inside = [&](int x, int y) { return x >= 0 && y >= 0 && x < size.width && y < size.height; };
            Mask core(depth.values.size()), expected(core.size());
            for (int y = 0; y < size.height; ++y)
                for (int x = 0; x < size.width; ++x)
                    for (const auto& [dx, dy] : {std::pair{1, 0}, {0, 1}, {1, 1}, {-1, 1}}) {
                        // Along the line both ways, to where depth jumps: is what is there farther?
                        int pixels = 1;
                        bool farther = true;
                        for (const int way : {-1, 1}) {
                            int i = x, j = y;
                            for (;; i += way * dx, j += way * dy, ++pixels) {
                                const int next_i = i + way * dx, next_j = j + way * dy;
                                if (!is_inside(next_i, next_j)) {
                                    farther = false;
                                    break;
                                }
                                if (std::abs(at(next_i, next_j) - at(i, j)) < 0.1f) continue;
                                farther = farther && at(next_i, next_j) > at(i, j);
                                break;
                            }
                        }
                        if (farther && pixels * std::hypot(dx, dy) < 2 * scale) core[y * size.width + x] = 1;
                    }
            for (int y = 0; y < size.height; ++y)
                for (int x = 0; x < size.width; ++x)
                    for (int j = -1; j <= 1; ++j)
                        for (int i = -1; i <= 1; ++i)
                            if (is_inside(x + i, y + j) && core[(y + j) * size.width + x + i])
                                expected[y * size.width + x] = 1;
            CHECK(metrics::thin_mask(depth, scale) == expected);
        }
}

TEST_CASE("masks are not made of images of different sizes") {
    MaskMaker maker(2);
    CHECK_THROWS_AS(maker.add({filled({4, 4}, 1, 0), filled({4, 5}, 2, 0)}, false), clarus::Error);
    maker.add({filled({4, 4}, 1, 0), filled({4, 4}, 2, 0)}, false);
    CHECK_THROWS_AS(maker.add({filled({5, 4}, 1, 0), filled({5, 4}, 2, 0)}, true), clarus::Error);
}
