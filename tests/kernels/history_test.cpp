#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "any_geometry.h"
#include "operator_harness.h"

using namespace clarus;
using namespace clarus::test;
using runtime::Storage;

// docs/history.md, pixel by pixel.
namespace {

float slope(const Planes& depth, int x, int y, int step_x, int step_y) {
    float least = kInfinity;
    for (const int sign : {-1, 1}) {
        const int column = x + sign * step_x, row = y + sign * step_y;
        if (is_inside(depth.shape, column, row))
            least = std::min(least, std::abs(depth.at(0, x, y) - depth.at(0, column, row)));
    }
    return std::isinf(least) ? 0 : least;
}

/// How the vector changes from one pixel to the next along an axis: as little as it does on either side.
std::array<float, 2> change(const Planes& motion, int x, int y, int step_x, int step_y) {
    std::array<float, 2> least{kNan, kNan};
    for (const int sign : {-1, 1}) {
        const int column = x + sign * step_x, row = y + sign * step_y;
        if (!is_inside(motion.shape, column, row)) continue;
        std::array<float, 2> found;
        for (int c = 0; c < 2; ++c) found[c] = sign * (motion.at(c, column, row) - motion.at(c, x, y));
        const auto size = [](const std::array<float, 2>& each) { return std::abs(each[0]) + std::abs(each[1]); };
        if (size(found) < size(least) || std::isnan(size(least))) least = found;
    }
    return least;
}

Planes expected_depth_before(const Planes& motion, const Planes& depth) {
    return planes(depth.shape, [&](int, int x, int y) {
        const auto [xx, yx] = change(motion, x, y, 1, 0);
        const auto [xy, yy] = change(motion, x, y, 0, 1);
        const float area = (1 + xx) * (1 + yy) - xy * yx;
        return std::min(depth.at(0, x, y) / std::cbrt(std::isfinite(area) ? std::clamp(area, 0.25f, 4.0f) : 1), 1.0f);
    });
}

/// Whether one of the 5×5 pixels around has that depth and was within a pixel of the tap, and whether one of the 3×3
/// has it and moves along (docs/history.md).
struct Around {
    bool near = false, companion = false;
};
Around look_around(const Planes& motion, const Planes& depth, int x, int y, const Tap& tap, float distance,
                   Vec2 jitter) {
    Around found;
    for (int row = y - 2; row <= y + 2; ++row)
        for (int column = x - 2; column <= x + 2; ++column) {
            if (!is_inside(depth.shape, column, row) || depth.at(0, column, row) != distance) continue;
            const float off_x = static_cast<float>(column - tap.x) + (jitter.x + motion.at(0, column, row)),
                        off_y = static_cast<float>(row - tap.y) + (jitter.y + motion.at(1, column, row));
            if (std::abs(off_x) < 1 && std::abs(off_y) < 1) found.near = true;
            if (std::abs(column - x) <= 1 && std::abs(row - y) <= 1 &&
                std::abs(motion.at(0, column, row) - motion.at(0, x, y)) <= 0.25f &&
                std::abs(motion.at(1, column, row) - motion.at(1, x, y)) <= 0.25f)
                found.companion = true;
        }
    return found;
}

bool has_history(const Planes& motion, const Planes& depth, const Planes& previous, int x, int y, Vec2 jitter) {
    if (!is_valid(motion, x, y)) return false;
    const Point place = previous_place(motion, x, y, jitter);
    const graph::Shape& shape = depth.shape;
    if (place.x < -0.5 || place.x > shape.width - 0.5 || place.y < -0.5 || place.y > shape.height - 0.5) return false;
    const float here = depth.at(0, x, y);
    const float tolerance =
        0.02f * here + 2 * (slope(depth, x, y, 1, 0) + slope(depth, x, y, 0, 1)) + std::ldexp(1.0f, -16);
    double seen = 0, hidden = 0;
    for (const Tap& tap : taps_around(place)) {
        if (!is_inside(shape, tap.x, tap.y)) continue;
        seen += tap.weight();
        const float before = previous.at(0, tap.x, tap.y);
        const Around around = look_around(motion, depth, x, y, tap, before, jitter);
        if (!around.companion && before < (around.near ? here - tolerance : here)) hidden += tap.weight();
    }
    return hidden <= seen / 2;
}

Planes expected_checked_motion(const Planes& motion, const Planes& depth, const Planes& previous, Vec2 jitter) {
    return planes(motion.shape, [&](int c, int x, int y) {
        return has_history(motion, depth, previous, x, y, jitter) ? motion.at(c, x, y) : kNan;
    });
}

std::array<float, 2> expected_vector(const Planes& motion, const Planes& depth, double scale, Point place) {
    const graph::Shape& shape = depth.shape;
    place = {std::clamp(place.x, 0.0, shape.width - 1.0), std::clamp(place.y, 0.0, shape.height - 1.0)};
    std::vector<Tap> taps;
    for (const Tap& tap : taps_around(place))
        if (tap.weight_x > 1e-3 && tap.weight_y > 1e-3) taps.push_back(tap);
    Tap foremost = taps.front(), largest = taps.front();
    float nearest = kInfinity, farthest = -kInfinity;
    std::array<float, 2> low{kInfinity, kInfinity}, high{-kInfinity, -kInfinity};
    std::array<double, 2> mean{};
    bool all_valid = true;
    for (const Tap& tap : taps) {
        const float distance = depth.at(0, tap.x, tap.y);
        if (distance < nearest) foremost = tap;
        if (tap.weight() > largest.weight()) largest = tap;
        nearest = std::min(nearest, distance);
        farthest = std::max(farthest, distance);
        all_valid = all_valid && is_valid(motion, tap.x, tap.y);
        if (!is_valid(motion, tap.x, tap.y)) continue;
        for (int c = 0; c < 2; ++c) {
            mean[c] += tap.weight() * motion.at(c, tap.x, tap.y);
            low[c] = std::min(low[c], motion.at(c, tap.x, tap.y));
            high[c] = std::max(high[c], motion.at(c, tap.x, tap.y));
        }
    }
    const bool apart = high[0] - low[0] > 0.25f || high[1] - low[1] > 0.25f;
    const bool silhouette = apart && farthest - nearest > 0.1f * nearest;
    if (!silhouette && all_valid) return {static_cast<float>(scale * mean[0]), static_cast<float>(scale * mean[1])};
    const Tap& chosen = silhouette ? foremost : largest;
    if (!is_valid(motion, chosen.x, chosen.y)) return {kNan, kNan};
    return {static_cast<float>(scale * motion.at(0, chosen.x, chosen.y)),
            static_cast<float>(scale * motion.at(1, chosen.x, chosen.y))};
}

Planes expected_reprojection(const Planes& motion, const Planes& depth, double scale, Size size, Vec2 jitter) {
    return planes({2, size.height, size.width}, [&](int c, int x, int y) {
        const Point place{(x + 0.5) / scale - 0.5 - jitter.x, (y + 0.5) / scale - 0.5 - jitter.y};
        return expected_vector(motion, depth, scale, place)[c];
    });
}

Planes expected_range(const Planes& color, const Planes& history, int scale) {
    const graph::Shape& in = color.shape;
    const auto extreme = [&](int c, int x, int y, bool greatest) {
        float found = greatest ? -kInfinity : kInfinity;
        for (int j = y - 1; j <= y + 1; ++j)
            for (int i = x - 1; i <= x + 1; ++i) {
                if (!is_inside(in, i, j) || std::isnan(color.at(c, i, j))) continue;
                found = greatest ? std::max(found, color.at(c, i, j)) : std::min(found, color.at(c, i, j));
            }
        return found;
    };
    const auto mean = [&](int c, int x, int y) {
        double sum = 0;
        for (int j = 0; j < scale; ++j)
            for (int i = 0; i < scale; ++i) sum += history.at(c, scale * x + i, scale * y + j);
        return sum / (scale * scale);
    };
    return planes({7, in.height, in.width}, [&](int channel, int x, int y) {
        if (channel < 6) return extreme(channel % 3, x, y, channel >= 3);
        bool outside = false;
        for (int c = 0; c < 3; ++c)
            outside = outside || mean(c, x, y) < extreme(c, x, y, false) - 2.0 / 255 ||
                      mean(c, x, y) > extreme(c, x, y, true) + 2.0 / 255;
        return outside ? 1.0f : 0.0f;
    });
}

Planes expected_belief(const Planes& range) {
    return planes({1, range.shape.height, range.shape.width}, [&](int, int x, int y) {
        int outside = 0, pixels = 0;
        for (int j = y - 2; j <= y + 2; ++j)
            for (int i = x - 2; i <= x + 2; ++i) {
                if (!is_inside(range.shape, i, j)) continue;
                ++pixels;
                outside += range.at(6, i, j) > 0;
            }
        return 2 * outside <= pixels ? 1.0f : 0.0f;
    });
}

struct Case {
    graph::Shape size;  // of the render image
    Vec2 jitter;
    int stride = 4, offset = 0;  // of depth
};

void check_history(const Case& test) {
    CAPTURE(test.size.width);
    CAPTURE(test.size.height);
    std::mt19937 random(11);
    const Planes motion = any_motion(test.size, random), depth = any_depth(test.size, random);
    const graph::Shape plane = depth.shape;
    const auto frame = frame_with(test.jitter, {0.25f, -0.5f});
    const Planes previous = expected_previous_depth(motion, depth, test.jitter);
    const auto depth_layout = part_layout(plane, Storage::f32, 1, test.stride, test.offset);
    const auto motion_layout = part_layout(motion.shape, Storage::f32, 1, 4, 1);

    runtime::Problem receding;
    receding.node = {graph::DepthBefore{}, {}, plane, "depth before"};
    receding.inputs = {motion_layout, depth_layout};
    receding.output = part_layout(plane, Storage::f32, 1, 4, 0);
    check_operator(receding, {motion, depth}, frame, expected_depth_before(motion, depth), 1e-6f);

    runtime::Problem fill;
    fill.node = {graph::Fill{1}, {}, plane, "fill"};
    fill.output = part_layout(plane, Storage::f32, 1, 4, 0);
    const Planes ones = planes(plane, [](int, int, int) { return 1.0f; });
    check_operator(fill, {}, frame, ones, 0);

    runtime::Problem scatter;
    scatter.node = {graph::PreviousDepth{}, {}, plane, "previous depth"};
    scatter.inputs = {fill.output, motion_layout, depth_layout};
    scatter.output = fill.output;
    check_operator(scatter, {ones, motion, depth}, frame, previous, 0);

    // Of any depths before, more of which are near.
    const Planes any = any_depth(test.size, random);
    runtime::Problem check;
    check.node = {graph::CheckedMotion{}, {}, motion.shape, "checked motion"};
    check.inputs = {motion_layout, depth_layout, fill.output};
    check.output = part_layout(motion.shape, Storage::f32, 1, 4, 0);
    check_operator(check, {motion, depth, previous}, frame,
                   expected_checked_motion(motion, depth, previous, test.jitter), 0);
    check_operator(check, {motion, depth, any}, frame, expected_checked_motion(motion, depth, any, test.jitter), 0);
}

void check_validity(graph::Shape size, Storage storage, bool reset) {
    std::mt19937 random(12);
    const Planes motion = any_motion(size, random);
    auto frame = frame_with({}, {});
    frame.reset = reset;
    runtime::Problem problem;
    problem.node = {graph::Validity{}, {}, {1, size.height, size.width}, "validity"};
    problem.inputs = {part_layout(motion.shape, Storage::f32, 1, 4, 0)};
    problem.output = part_layout(problem.node.shape, storage, 1, 24, 6);
    check_operator(
        problem, {motion}, frame,
        planes(problem.node.shape, [&](int, int x, int y) { return !reset && is_valid(motion, x, y) ? 1.0f : 0.0f; }),
        0);
}

Size scaled(graph::Shape size, double scale) {
    return {static_cast<int>(std::lround(size.width * scale)), static_cast<int>(std::lround(size.height * scale))};
}

void check_reprojection(const Case& test, double scale, int block = 1) {
    CAPTURE(scale);
    CAPTURE(test.size.width);
    CAPTURE(test.size.height);
    CAPTURE(test.jitter.x);
    std::mt19937 random(13);
    const Planes motion = any_motion(test.size, random), depth = any_depth(test.size, random);
    const Size size = scaled(test.size, scale);
    const Planes expected = expected_reprojection(motion, depth, scale, size, test.jitter);
    runtime::Problem problem;
    problem.node = {graph::Reproject{scale}, {}, expected.shape, "reproject"};
    problem.inputs = {part_layout(motion.shape, Storage::f32, 1, 4, 1),
                      part_layout(depth.shape, Storage::f32, 1, test.stride, test.offset)};
    problem.output = part_layout(expected.shape, Storage::f32, block, 4 * block * block, 0);
    // Vectors as long as the image may cancel out.
    const float tolerance = 2e-6f + 6e-8f * static_cast<float>(size.width);
    check_operator(problem, {motion, depth}, frame_with({-0.375f, 0.125f}, test.jitter), expected, tolerance);
}

void check_range(Size size, int scale, Storage storage, int stride, int offset, int block = 1) {
    CAPTURE(size.width);
    CAPTURE(size.height);
    CAPTURE(scale);
    std::mt19937 random(14);
    const graph::Shape render{3, size.height, size.width}, output{4, size.height * scale, size.width * scale};
    Planes color = rounded(random_planes(render, random), storage);
    for (size_t i = 0; i < color.values.size(); i += 37) color.values[i] = kNan;
    const Planes history = rounded(random_planes(output, random, -0.5f, 1.5f), storage);
    const Planes expected = expected_range(color, history, scale);
    runtime::Problem problem;
    problem.node = {graph::Range{scale}, {}, expected.shape, "range"};
    problem.inputs = {part_layout(render, storage, 1, stride, offset),
                      part_layout(output, storage, block, 4 * block * block + 3, 2)};
    problem.output = part_layout(expected.shape, storage, 1, 8, 0);
    check_operator(problem, {color, history}, {}, expected, 0);

    const Planes belief = expected_belief(expected);
    problem.node = {graph::Believed{}, {}, belief.shape, "believed"};
    problem.inputs = {part_layout(expected.shape, storage, 1, 8, 0)};
    problem.output = part_layout(belief.shape, storage, 1, 4, 0);
    check_operator(problem, {expected}, {}, belief, 0);
}

}  // namespace

TEST_CASE("history is where the surface was seen") {
    check_history({{1, 34, 61}, {0.375f, -0.25f}, 24, 3});
    check_history({{1, 41, 130}, {0, 0}});
    check_history({{1, 67, 3}, {-0.5f, 0.5f}});
}

TEST_CASE("a surface that comes into sight behind another has no history") {
    // A near square moves three pixels to the right before a far wall that stands still; depth slopes nowhere.
    const graph::Shape size{1, 12, 20};
    const auto is_near = [](int x, int y) { return x >= 8 && x < 14 && y >= 3 && y < 9; };
    const Planes depth = planes(size, [&](int, int x, int y) { return is_near(x, y) ? 0.25f : 0.75f; });
    const Planes motion =
        planes({2, 12, 20}, [&](int c, int x, int y) { return c == 0 && is_near(x, y) ? -3.0f : 0.0f; });
    const Planes checked =
        expected_checked_motion(motion, depth, expected_previous_depth(motion, depth, {0, 0}), {0, 0});
    for (int y = 0; y < 12; ++y)
        for (int x = 0; x < 20; ++x) {
            CAPTURE(x);
            CAPTURE(y);
            const bool uncovered = x >= 5 && x < 8 && y >= 3 && y < 9;
            CHECK(is_valid(checked, x, y) == !uncovered);
        }
}

TEST_CASE("a thing that moves along with the camera uncovers the ground behind it") {
    // The camera drives over a plane, seen from row −1, its horizon, on; a box before it keeps its distance.
    constexpr int kWidth = 21, kHeight = 40;
    constexpr float kHorizon = 8, kBox = 0.5f,
                    kDriven = 0.1f;  // distances of row 0, of the box; what is driven a frame
    const auto distance = [](int y) { return kHorizon / (y + 1); };
    const auto is_box = [&](int x, int y) { return x >= 5 && x < 16 && distance(y) >= kBox; };
    const Planes depth = planes({1, kHeight, kWidth},
                                [&](int, int x, int y) { return is_box(x, y) ? kBox : std::min(distance(y), 1.0f); });
    const auto row_before = [&](int y) { return kHorizon / (distance(y) + kDriven) - 1; };
    const Planes motion = planes({2, kHeight, kWidth}, [&](int c, int x, int y) {
        if (is_box(x, y)) return 0.0f;
        const float size_before = distance(y) / (distance(y) + kDriven);
        return c == 0 ? (x - kWidth / 2) * (size_before - 1) : row_before(y) - y;
    });
    const Planes before = expected_depth_before(motion, depth);
    const Planes checked =
        expected_checked_motion(motion, before, expected_previous_depth(motion, before, {0, 0}), {0, 0});
    const float last_of_box = kHorizon / kBox - 1;
    int uncovered = 0;
    for (int y = 16; y < kHeight; ++y)
        for (int x = 7; x < 14; ++x) {
            CAPTURE(x);
            CAPTURE(y);
            CHECK(before.at(0, x, y) == doctest::Approx(distance(y) + kDriven).epsilon(0.02));
            const float beyond = row_before(y) - (last_of_box + 0.5f);
            if (std::abs(beyond) < 0.75f) continue;  // the box's edge is a pixel
            CHECK(is_valid(checked, x, y) == (beyond > 0));
            uncovered += beyond < 0;
        }
    CHECK(uncovered == 3 * 7);
}

TEST_CASE("a bar that stands still before a wall hides nothing of it") {
    const graph::Shape size{1, 9, 11};
    const Vec2 jitter{0.375f, -0.25f};
    const Planes depth = planes(size, [](int, int x, int) { return x == 5 ? 0.25f : 0.75f; });
    const Planes still = planes({2, 9, 11}, [](int, int, int) { return 0.0f; });
    const Planes previous = expected_previous_depth(still, depth, jitter);
    const Planes checked = expected_checked_motion(still, depth, previous, jitter);
    for (int y = 1; y < 9; ++y)
        for (int x = 0; x < 10; ++x) CHECK(is_valid(checked, x, y));
}

TEST_CASE("validity tells valid vectors from others") {
    check_together([&] {
        for (const Storage storage : {Storage::f32, Storage::f16})
            for (const bool reset : {false, true}) check_validity({1, 19, 83}, storage, reset);
    });
}

TEST_CASE("reproject takes no vector across a silhouette") {
    check_together([&] {
        for (const double scale : {1.0, 1.5, 2.0, 3.0}) check_reprojection({{1, 37, 53}, {0, 0}, 24, 3}, scale);
        for (const double scale : {1.0, 1.5, 1.7, 2.0, 3.0, 4.0, 6.0})
            check_reprojection({{1, 21, 75}, {0.3125f, -0.4375f}}, scale);
        check_reprojection({{1, 11, 13}, {-0.75f, 1.375f}}, 2.0, 2);
    });
}

TEST_CASE("a range is that of the pixels around, and history outside of it is not believed") {
    check_together([&] {
        for (const Storage storage : {Storage::f32, Storage::f16}) {
            for (const int scale : {1, 2, 3, 4}) check_range({47, 23}, scale, storage, 4, 0);
            for (const int scale : {2, 3, 4}) check_range({70, 9}, scale, storage, 27, 5, scale);
            check_range({5, 7}, 2, storage, 27, 5, 4);
        }
    });
}

TEST_SUITE("small") {
    TEST_CASE("history of small images") {
        check_together([&] {
            check_history({{1, 1, 1}, {0, 0}});
            check_history({{1, 1, 9}, {0.25f, -0.5f}});
            check_history({{1, 7, 5}, {-0.375f, 0.125f}, 1, 0});
            check_validity({1, 3, 5}, Storage::f32, false);
            check_validity({1, 1, 1}, Storage::f32, true);
        });
    }

    TEST_CASE("reproject of small images") {
        check_together([&] {
            for (const double scale : {1.0, 1.5, 3.0}) {
                check_reprojection({{1, 1, 1}, {0.375f, 0}}, scale);
                check_reprojection({{1, 5, 7}, {0.25f, -0.3125f}}, scale);
            }
            check_reprojection({{1, 1, 6}, {0, 0}}, 2);
        });
    }

    TEST_CASE("ranges of small images") {
        check_together([&] {
            for (const Size size : {Size{1, 1}, Size{7, 1}, Size{5, 8}}) check_range(size, 2, Storage::f32, 4, 0);
        });
    }
}
