#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <utility>

#include "operator_harness.h"

using namespace clarus;
using namespace clarus::test;
using runtime::Storage;

namespace {

/// An image of which x and y may be exchanged.
struct Turned {
    const Planes& image;
    bool turned;

    int width() const { return turned ? image.shape.height : image.shape.width; }
    int height() const { return turned ? image.shape.width : image.shape.height; }
    float at(int c, int u, int v) const { return turned ? image.at(c, v, u) : image.at(c, u, v); }
    bool inside(int u, int v) const { return u >= 0 && v >= 0 && u < width() && v < height(); }
    bool differ(int au, int av, int bu, int bv) const {
        if (!inside(au, av) || !inside(bu, bv)) return false;
        for (int c = 0; c < 3; ++c)
            if (std::abs(at(c, au, av) - at(c, bu, bv)) >= graph::kMlaaThreshold) return true;
        return false;
    }
};

/// ∫ ½ (1 − 2t / length) dt over a pixel that begins `distance` from the line's end, up to the line's middle.
double area(int distance, int length) {
    const auto integral = [&](double t) { return 0.5 * (t - t * t / length); };
    const double middle = length / 2.0;
    return distance < middle ? integral(std::min(distance + 1.0, middle)) - integral(distance) : 0;
}

/// Line by line, where the kernel goes pixel by pixel: adds what the lines along u give to `result`.
void add_lines(const Turned& image, Planes& result) {
    const auto across = [&](int u, int v) { return image.differ(u, v, u + 1, v); };
    const auto along = [&](int u, int v) { return image.differ(u, v, u, v + 1); };
    // The step at the grid corner between columns u and u + 1, rows v and v + 1.
    const auto step = [&](int u, int v) {
        const bool up = across(u, v), down = across(u, v + 1);
        if (up == down) return 0;
        if (up) return across(u, v - 1) ? 0 : -1;
        return across(u, v + 2) ? 0 : 1;
    };
    const auto share = [&](int before, int after, int first_step, int last_step, int side) {
        if (before >= graph::kMlaaReach) first_step = 0;
        if (after >= graph::kMlaaReach) last_step = 0;
        const int length = std::min(before, graph::kMlaaReach) + std::min(after, graph::kMlaaReach) + 1;
        if (length == 1 && (image.turned || first_step * last_step != -1)) return 0.0;
        return (first_step == side ? area(before, length) : 0) + (last_step == side ? area(after, length) : 0);
    };
    for (int v = 0; v + 1 < image.height(); ++v) {
        for (int first = 0; first < image.width(); ++first) {
            if (!along(first, v)) continue;
            int last = first;
            while (along(last + 1, v) && !across(last, v) && !across(last, v + 1)) ++last;
            for (int u = first; u <= last; ++u) {
                for (const int side : {-1, 1}) {
                    const int mine = side < 0 ? v : v + 1, other = side < 0 ? v + 1 : v;
                    if (along(u, mine - 1) && along(u, mine)) continue;  // one pixel thin
                    const double part = share(u - first, last - u, step(first - 1, v), step(last, v), side);
                    for (int c = 0; c < 3; ++c)
                        (image.turned ? result.at(c, mine, u) : result.at(c, u, mine)) +=
                            static_cast<float>(part * (image.at(c, u, other) - image.at(c, u, mine)));
                }
            }
            first = last;
        }
    }
}

Planes expected_mlaa(const Planes& image) {
    Planes result = image;
    for (const bool turned : {false, true}) add_lines({image, turned}, result);
    return result;
}

runtime::Problem problem(graph::Shape shape, Storage storage, int block = 1) {
    runtime::Problem problem;
    problem.node = {graph::Mlaa{}, {}, shape, "mlaa"};
    problem.inputs = {part_layout(shape, storage, block, 4 * block * block, 0)};
    problem.output = pixel_layout(shape, storage);
    return problem;
}

Planes mlaa(const Planes& image) {
    const runtime::Implementation& implementation = runtime::mlaa_implementations().back();
    return run_operator(problem(image.shape, Storage::f32), implementation, {{"WG_X", 64}, {"WG_Y", 1}}, {image}, {});
}

void check_mlaa(const Planes& image, Storage storage = Storage::f32, int block = 1) {
    check_operator(problem(image.shape, storage, block), {rounded(image, storage)}, {},
                   expected_mlaa(rounded(image, storage)), storage_tolerance(storage));
}

Planes grey(Size size, const std::function<float(int x, int y)>& value) {
    return planes({3, size.height, size.width}, [&](int, int x, int y) { return value(x, y); });
}

/// Rectangles of few levels, one over the other: lines of many kinds.
Planes rectangles(Size size, std::mt19937& random, int longest) {
    Planes image = grey(size, [](int, int) { return 0.5f; });
    std::uniform_int_distribution<int> level(0, 4), side(1, longest), left(-2, size.width), top(-2, size.height);
    for (int count = size.width * size.height / 6; count > 0; --count) {
        const int x = left(random), y = top(random), right = x + side(random), bottom = y + side(random) / 2 + 1;
        const std::array<float, 3> color{level(random) / 4.0f, level(random) / 4.0f, level(random) / 4.0f};
        for (int c = 0; c < 3; ++c)
            for (int j = std::max(y, 0); j < std::min(bottom, size.height); ++j)
                for (int i = std::max(x, 0); i < std::min(right, size.width); ++i) image.at(c, i, j) = color[c];
    }
    return image;
}

/// How much of pixel (x, y) lies above the slanted edge whose sampling at pixel centres is y <= 4 + ⌊x / run⌋.
double coverage(int x, int y, int run) {
    constexpr int kSamples = 64;
    int count = 0;
    for (int j = 0; j < kSamples; ++j)
        for (int i = 0; i < kSamples; ++i) count += y + (j + 0.5) / kSamples < 4.5 + (x + (i + 0.5) / kSamples) / run;
    return double(count) / (kSamples * kSamples);
}

}  // namespace

TEST_CASE("MLAA is what it is defined as on lines of all kinds") {
    std::mt19937 random(12);
    for (int longest = 3; longest < 20; longest += 3) check_mlaa(rectangles({41, 29}, random, longest));
    check_mlaa(rectangles({37, 23}, random, 9), Storage::f16);
    check_mlaa(rectangles({36, 24}, random, 9), Storage::f32, 2);
}

TEST_CASE("MLAA looks for a line's end no farther than it reaches") {
    for (const int length : {63, 64, 65, 130})
        check_mlaa(grey({2 * length + 20, 5}, [&](int x, int y) { return y > 1 + (x > length) ? 1.0f : 0.0f; }));
}

TEST_CASE("MLAA leaves flat images, upright edges, corners and thin lines as they are") {
    const auto check_unchanged = [](const std::function<float(int x, int y)>& value) {
        const Planes image = grey({40, 30}, value);
        check_close(mlaa(image), image, 0);
    };
    check_unchanged([](int, int) { return 0.3f; });
    check_unchanged([](int x, int y) { return 0.001f * static_cast<float>(x) + 0.03f * static_cast<float>(y); });
    check_unchanged([](int x, int) { return x < 17 ? 0.0f : 1.0f; });
    check_unchanged([](int, int y) { return y < 11 ? 0.9f : 0.2f; });
    check_unchanged([](int x, int y) { return x > 4 && x < 31 && y > 7 && y < 20 ? 1.0f : 0.0f; });
    check_unchanged([](int x, int y) { return x > 4 && x < 31 && y == 7 ? 1.0f : 0.0f; });
    check_unchanged([](int x, int y) { return x == 9 && y == 7 ? 1.0f : 0.0f; });
}

TEST_CASE("MLAA smooths a staircase to the coverage of the slanted edge") {
    for (const int run : {1, 2, 3, 5, 8}) {
        CAPTURE(run);
        const int length = 12 * run, height = 20;
        const auto stair = [&](int x, int y) { return y <= 4 + x / run ? 1.0f : 0.0f; };
        const Planes level = mlaa(grey({length, height}, stair));
        const Planes upright = mlaa(grey({height, length}, [&](int x, int y) { return stair(y, x); }));
        // Lines that end at the border have no step there.
        for (int x = run; x < length - run; ++x) {
            for (int y = 0; y < height; ++y) {
                CHECK(std::abs(level.at(1, x, y) - coverage(x, y, run)) < 0.01);
                CHECK(std::abs(upright.at(1, y, x) - coverage(x, y, run)) < 0.01);
            }
        }
    }
}

TEST_CASE("MLAA stays between a pixel and its neighbours") {
    std::mt19937 random(5);
    const Size size{31, 23};
    for (const Planes& image : {random_planes({3, size.height, size.width}, random), rectangles(size, random, 7)}) {
        const Planes result = mlaa(image);
        int outside = 0;
        for (int c = 0; c < 3; ++c) {
            for (int y = 0; y < size.height; ++y) {
                for (int x = 0; x < size.width; ++x) {
                    float low = image.at(c, x, y), high = low;
                    for (const auto& [dx, dy] : {std::pair{-1, 0}, {1, 0}, {0, -1}, {0, 1}}) {
                        const float value =
                            image.at(c, std::clamp(x + dx, 0, size.width - 1), std::clamp(y + dy, 0, size.height - 1));
                        low = std::min(low, value);
                        high = std::max(high, value);
                    }
                    outside += result.at(c, x, y) < low - 1e-6f || result.at(c, x, y) > high + 1e-6f;
                }
            }
        }
        CHECK(outside == 0);
    }
}

TEST_SUITE("small") {
    TEST_CASE("MLAA of small images") {
        std::mt19937 random(1);
        check_mlaa(random_planes({3, 1, 1}, random));
        check_mlaa(random_planes({3, 1, 7}, random));
        check_mlaa(rectangles({6, 5}, random, 3));
    }
}
