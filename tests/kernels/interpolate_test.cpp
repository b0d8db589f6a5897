#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "any_geometry.h"
#include "base/rounding.h"
#include "operator_harness.h"

using namespace clarus;
using namespace clarus::test;
using runtime::Storage;

// docs/interpolate.md, pixel by pixel.
namespace {

constexpr float kNone = graph::kNoSource;

Planes expected_source(const Planes& motion, const Planes& depth, const Planes& landed, Vec2 jitter) {
    Planes result = planes(depth.shape, [](int, int, int) { return kNone; });
    for (int y = depth.shape.height - 1; y >= 0; --y)
        for (int x = depth.shape.width - 1; x >= 0; --x) {
            if (!is_valid(motion, x, y)) continue;
            for (const Tap& tap : taps_around(previous_place(motion, x, y, jitter, 0.5)))
                if (is_inside(depth.shape, tap.x, tap.y) && tap.weight() > 0.1 &&
                    landed.at(0, tap.x, tap.y) == depth.at(0, x, y))
                    result.at(0, tap.x, tap.y) = static_cast<float>(y * depth.shape.width + x);
        }
    return result;
}

struct Surface {
    float x = 0, y = 0, depth = -1;
};

class Middle {
  public:
    Middle(const Planes& motion, const Planes& depth, const Planes& source)
        : motion_(motion), depth_(depth), source_(source) {}

    Planes expected() const {
        const graph::Shape& size = depth_.shape;
        Planes result = planes({graph::kMiddle, size.height, size.width}, [](int, int, int) { return 0.0f; });
        for (int y = 0; y < size.height; ++y)
            for (int x = 0; x < size.width; ++x) {
                Surface surface = is_hole(x, y) ? around(x, y) : shown(x, y);
                float shown_by = is_hole(x, y) || is_rim(x, y, surface) ? 1.0f : 0.0f;
                if (surface.depth < 0) {
                    surface = {0, 0, 1};
                    shown_by = 0.5f;
                }
                const std::array values{surface.x, surface.y, surface.depth, shown_by};
                for (int c = 0; c < graph::kMiddle; ++c) result.at(c, x, y) = values[c];
            }
        return result;
    }

  private:
    bool is_hole(int x, int y) const { return source_.at(0, x, y) == kNone; }

    Surface shown(int x, int y) const {
        const int number = static_cast<int>(source_.at(0, x, y)), width = depth_.shape.width;
        const int column = number % width, row = number / width;
        return {motion_.at(0, column, row), motion_.at(1, column, row), depth_.at(0, column, row)};
    }

    Surface around(int x, int y) const {
        Surface farthest;
        for (int step_y = -1; step_y <= 1; ++step_y)
            for (int step_x = -1; step_x <= 1; ++step_x) {
                if (step_x == 0 && step_y == 0) continue;
                int i = 1;
                while (i < 64 && is_inside(source_.shape, x + i * step_x, y + i * step_y) &&
                       is_hole(x + i * step_x, y + i * step_y))
                    ++i;
                if (!is_inside(source_.shape, x + i * step_x, y + i * step_y)) continue;
                if (is_hole(x + i * step_x, y + i * step_y)) continue;
                const Surface found = shown(x + i * step_x, y + i * step_y);
                if (found.depth > farthest.depth) farthest = found;
            }
        return farthest;
    }

    bool is_rim(int x, int y, const Surface& here) const {
        for (int row = y - 1; row <= y + 1; ++row)
            for (int column = x - 1; column <= x + 1; ++column) {
                if (!is_inside(source_.shape, column, row) || !is_hole(column, row)) continue;
                const Surface hole = around(column, row);
                if (std::abs(hole.x - here.x) < 1 && std::abs(hole.y - here.y) < 1) return true;
            }
        return false;
    }

    const Planes &motion_, &depth_, &source_;
};

double keys(double t) {
    t = std::abs(t);
    if (t < 1) return (1.5 * t - 2.5) * t * t + 1;
    return t < 2 ? ((-0.5 * t + 2.5) * t - 4) * t + 2 : 0;
}

double sampled(const Planes& image, int channel, double x, double y) {
    const int column = static_cast<int>(std::floor(x)), row = static_cast<int>(std::floor(y));
    double sum = 0, low = kInfinity, high = -kInfinity;
    for (int j = row - 1; j <= row + 2; ++j)
        for (int i = column - 1; i <= column + 2; ++i) {
            const double value =
                image.at(channel, std::clamp(i, 0, image.shape.width - 1), std::clamp(j, 0, image.shape.height - 1));
            sum += keys(x - i) * keys(y - j) * value;
            if (i < column || i > column + 1 || j < row || j > row + 1) continue;
            low = std::min(low, value);
            high = std::max(high, value);
        }
    return std::clamp(sum, low, high);
}

struct Found {
    double x = 0, y = 0, shown_by = 0;
};

Found expected_at(const Planes& middle, double scale, int x, int y) {
    const graph::Shape& size = middle.shape;
    const Point place{std::clamp((x + 0.5) / scale - 0.5, 0.0, size.width - 1.0),
                      std::clamp((y + 0.5) / scale - 0.5, 0.0, size.height - 1.0)};
    std::vector<Tap> taps;
    for (const Tap& tap : taps_around(place))
        if (tap.weight_x > 1e-3 && tap.weight_y > 1e-3) taps.push_back(tap);
    const auto compare = [&](int c) {
        return [&middle, c](const Tap& a, const Tap& b) { return middle.at(c, a.x, a.y) < middle.at(c, b.x, b.y); };
    };
    const auto spread = [&](int c) {
        const auto [least, most] = std::minmax_element(taps.begin(), taps.end(), compare(c));
        return middle.at(c, most->x, most->y) - middle.at(c, least->x, least->y);
    };
    const Tap foremost = *std::min_element(taps.begin(), taps.end(), compare(2));
    const float apart = std::max(spread(0), spread(1));
    const bool deep = spread(2) > 0.1f * middle.at(2, foremost.x, foremost.y);
    Found found;
    if (apart > 1 || (apart > 0.25f && deep)) {
        found = {middle.at(0, foremost.x, foremost.y), middle.at(1, foremost.x, foremost.y)};
    } else {
        for (const Tap& tap : taps) {
            found.x += tap.weight() * middle.at(0, tap.x, tap.y);
            found.y += tap.weight() * middle.at(1, tap.x, tap.y);
        }
    }
    for (const Tap& tap : taps)
        if (std::abs(middle.at(0, tap.x, tap.y) - found.x) < 1 && std::abs(middle.at(1, tap.x, tap.y) - found.y) < 1)
            found.shown_by = std::max<double>(found.shown_by, middle.at(3, tap.x, tap.y));
    return found;
}

Planes expected_between(const Planes& middle, const Planes& color, const Planes& previous, double scale) {
    const graph::Shape& size = color.shape;
    Planes result = color;
    for (int y = 0; y < size.height; ++y)
        for (int x = 0; x < size.width; ++x) {
            const Found found = expected_at(middle, scale, x, y);
            const double dx = std::clamp<double>(scale * found.x / 2, -size.width, size.width);
            const double dy = std::clamp<double>(scale * found.y / 2, -size.height, size.height);
            const auto is_shown = [&](double column, double row) {
                return column >= -0.5 && column <= size.width - 0.5 && row >= -0.5 && row <= size.height - 0.5;
            };
            std::array<double, 3> now{}, before{};
            double apart = 0;
            for (int c = 0; c < 3; ++c) {
                now[c] = sampled(color, c, x - dx, y - dy);
                before[c] = sampled(previous, c, x + dx, y + dy);
                apart = std::max(apart, std::abs(now[c] - before[c]));
            }
            double share = 0.5 + (found.shown_by - 0.5) * std::clamp((apart - 0.1) / 0.3, 0.0, 1.0);
            if (is_shown(x - dx, y - dy) != is_shown(x + dx, y + dy)) share = is_shown(x - dx, y - dy) ? 0 : 1;
            for (int c = 0; c < 3; ++c) result.at(c, x, y) = static_cast<float>(now[c] + share * (before[c] - now[c]));
        }
    return result;
}

void check_source(graph::Shape size, Vec2 jitter, int stride = 4, int offset = 0) {
    CAPTURE(size.width);
    CAPTURE(size.height);
    std::mt19937 random(21);
    const Planes motion = any_motion(size, random), depth = any_depth(size, random);
    const Planes landed = expected_previous_depth(motion, depth, jitter, 0.5);
    const Planes ones = planes(size, [](int, int, int) { return 1.0f; });
    const Planes none = planes(size, [](int, int, int) { return kNone; });
    const auto plane = part_layout(size, Storage::f32, 1, 4, 0);
    const auto motion_layout = part_layout(motion.shape, Storage::f32, 1, 4, 1);
    const auto depth_layout = part_layout(size, Storage::f32, 1, stride, offset);

    runtime::Problem scatter;
    scatter.node = {graph::PreviousDepth{0.5f}, {}, size, "landed depth"};
    scatter.inputs = {plane, motion_layout, depth_layout};
    scatter.output = plane;
    check_operator(scatter, {ones, motion, depth}, frame_with(jitter, {0.25f, -0.5f}), landed, 0);

    runtime::Problem problem;
    problem.node = {graph::LandedSource{0.5f}, {}, size, "landed source"};
    problem.inputs = {plane, motion_layout, depth_layout, plane};
    problem.output = plane;
    const Planes source = expected_source(motion, depth, landed, jitter);
    check_operator(problem, {none, motion, depth, landed}, frame_with(jitter, {0.25f, -0.5f}), source, 0);

    runtime::Problem middle;
    middle.node = {graph::MiddleMotion{}, {}, {graph::kMiddle, size.height, size.width}, "middle motion"};
    middle.inputs = {motion_layout, depth_layout, plane};
    middle.output = part_layout(middle.node.shape, Storage::f32, 1, 8, 4);
    check_operator(middle, {motion, depth, source}, frame_with(jitter, {}), Middle(motion, depth, source).expected(),
                   0);
    check_operator(middle, {motion, depth, none}, frame_with(jitter, {}), Middle(motion, depth, none).expected(), 0);
}

/// Vectors and depths of several surfaces, some of which only the previous frame shows.
Planes any_middle(graph::Shape size, std::mt19937& random) {
    const Planes depth = any_depth({1, size.height, size.width}, random);
    std::uniform_int_distribution kinds(0, 9), eighths(-48, 48), near(-1, 1);
    std::array<float, 4> pixel{};
    Planes result = planes({graph::kMiddle, size.height, size.width}, [](int, int, int) { return 0.0f; });
    for (int y = 0; y < size.height; ++y)
        for (int x = 0; x < size.width; ++x) {
            const int kind = kinds(random);
            if (kind < 2) pixel = {eighths(random) / 8.0f, eighths(random) / 8.0f, 0, near(random) > 0 ? 1.0f : 0.0f};
            if (kind == 2) pixel[0] += near(random) / 8.0f;
            if (kind == 3) pixel[1] = near(random) * static_cast<float>(2 * size.height);
            if (kind == 4) pixel[3] = 0.5f;
            for (int c = 0; c < graph::kMiddle; ++c) result.at(c, x, y) = c == 2 ? depth.at(0, x, y) : pixel[c];
        }
    return result;
}

void check_between(graph::Shape size, double scale, Storage storage = Storage::f32, int block = 1) {
    CAPTURE(scale);
    CAPTURE(size.width);
    CAPTURE(size.height);
    std::mt19937 random(22);
    const Planes middle = any_middle(size, random);
    const Size output = scaled({size.width, size.height}, scale);
    const graph::Shape shape{3, output.height, output.width};
    const Planes color = rounded(random_planes(shape, random), storage);
    const Planes previous = rounded(random_planes(shape, random), storage);
    runtime::Problem problem;
    problem.node = {graph::Between{scale}, {}, shape, "between"};
    problem.inputs = {part_layout(middle.shape, Storage::f32, 1, 4, 0),
                      part_layout(shape, storage, block, 4 * block * block, 0), part_layout(shape, storage, 1, 4, 0)};
    problem.output = part_layout(shape, storage, block, 4 * block * block, 0);
    // An image's coordinates hold fractions of 2^-24 times its size, and Keys' filter may double what that makes.
    const float tolerance = storage == Storage::f16 ? 1e-3f : 2e-5f;
    auto frame = frame_with({0.25f, -0.25f}, {0.25f, -0.25f});
    check_operator(problem, {middle, color, previous}, frame, expected_between(middle, color, previous, scale),
                   tolerance);
    frame.reset = 1;
    check_operator(problem, {middle, color, previous}, frame, color, 0);
}

}  // namespace

TEST_CASE("pixels land half-way, the nearest first, and holes are filled from the far side") {
    check_source({1, 34, 61}, {0.375f, -0.25f}, 24, 3);
    check_source({1, 41, 130}, {0, 0});
    check_source({1, 67, 3}, {-0.5f, 0.5f});
}

TEST_CASE("a frame in between is looked up in both neighbours") {
    for (const double scale : {1.0, 2.0, 4.0}) check_between({1, 19, 37}, scale);
    check_between({1, 17, 70}, 2, Storage::f16);
    check_between({1, 11, 13}, 2, Storage::f32, 2);
}

TEST_SUITE("small") {
    TEST_CASE("interpolation of small images") {
        check_source({1, 1, 1}, {0, 0});
        check_source({1, 1, 9}, {0.25f, -0.5f});
        check_source({1, 7, 5}, {-0.375f, 0.125f}, 1, 0);
        check_between({1, 1, 1}, 1);
        check_between({1, 1, 1}, 2);
        check_between({1, 3, 5}, 1.5);
        check_between({1, 1, 6}, 2);
    }
}
