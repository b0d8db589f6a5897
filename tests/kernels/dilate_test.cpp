#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "operator_harness.h"

using namespace clarus;
using namespace clarus::test;
using runtime::Storage;

namespace {

Planes expected_dilation(const Planes& motion, const Planes& depth, int scale) {
    const int width = depth.shape.width, height = depth.shape.height;
    const graph::Shape blocks{2, (height * scale + 7) / 8, (width * scale + 7) / 8};
    return planes(blocks, [&](int c, int bx, int by) {
        int nearest_x = -1, nearest_y = -1;
        for (int y = 8 * by / scale; y <= std::min((8 * by + 7) / scale, height - 1); ++y) {
            for (int x = 8 * bx / scale; x <= std::min((8 * bx + 7) / scale, width - 1); ++x) {
                if (nearest_x >= 0 && depth.at(0, x, y) >= depth.at(0, nearest_x, nearest_y)) continue;
                nearest_x = x;
                nearest_y = y;
            }
        }
        return static_cast<float>(scale) * motion.at(c, nearest_x, nearest_y);
    });
}

/// Few different depths, so that ties decide; some vectors invalid.
void check_dilation(int width, int height, int scale, Storage storage, int stride, int offset) {
    CAPTURE(width);
    CAPTURE(height);
    CAPTURE(scale);
    std::mt19937 random(3);
    const graph::Shape depth_shape{1, height, width}, motion_shape{2, height, width};
    std::uniform_int_distribution levels(0, 5);
    const Planes depth =
        rounded(planes(depth_shape, [&](int, int, int) { return static_cast<float>(levels(random)) / 5; }), storage);
    Planes motion = random_planes(motion_shape, random, -20, 20);
    for (float& component : motion.values)
        if (levels(random) == 0) component = std::numeric_limits<float>::quiet_NaN();

    const Planes expected = expected_dilation(motion, depth, scale);
    runtime::Problem problem;
    problem.node = {graph::Dilate{scale}, {}, expected.shape, "dilate"};
    problem.inputs = {part_layout(motion_shape, Storage::f32, 1, 4, 1),
                      part_layout(depth_shape, storage, 1, stride, offset)};
    problem.output = pixel_layout(expected.shape, Storage::f32);
    check_operator(problem, {motion, depth}, {}, expected, 1e-6f);
}

}  // namespace

TEST_CASE("dilate takes the nearest pixel's motion") {
    for (const int scale : {2, 3, 4}) {
        check_dilation(61, 34, scale, Storage::f32, 24, 3);
        check_dilation(40, 22, scale, Storage::f16, 1, 0);
    }
    check_dilation(29, 31, 1, Storage::f32, 1, 0);
    check_dilation(5, 5, 6, Storage::f32, 4, 0);
}

TEST_SUITE("small") {
    TEST_CASE("dilate of small images") {
        check_dilation(1, 1, 2, Storage::f32, 3, 2);
        check_dilation(7, 5, 3, Storage::f16, 24, 3);
    }
}
