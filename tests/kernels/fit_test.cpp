#include <doctest/doctest.h>

#include <algorithm>
#include <limits>

#include "fit_reference.h"
#include "operator_harness.h"

using namespace clarus;
using namespace clarus::test;
using runtime::Storage;

namespace {

runtime::Problem problem_of(graph::Shape in, Size size, Storage storage, int block = 1) {
    const graph::Shape out{in.channels, size.height, size.width};
    runtime::Problem problem;
    problem.node = {graph::Fit{}, {}, out, "fit"};
    problem.inputs = {block == 1 ? part_layout(in, storage, 1, in.channels <= 3 ? 4 : in.channels + 4, 0)
                                 : part_layout(in, storage, block, 3 * block * block + 8, 4)};
    problem.output = block == 1 ? pixel_layout(out, storage) : part_layout(out, storage, 1, 7, 2);
    return problem;
}

void check_fit(const Planes& given, Size size, Storage storage, int block = 1) {
    CAPTURE(given.shape.width);
    CAPTURE(size.width);
    CAPTURE(size.height);
    const Planes image = rounded(given, storage);
    check_operator(problem_of(image.shape, size, storage, block), {image}, {}, expected_fit(image, size),
                   2 * storage_tolerance(storage));
}

/// Values beyond what is shown among them.
Planes random_image(graph::Shape shape) {
    std::mt19937 random(7);
    return random_planes(shape, random, -0.25f, 1.25f);
}

}  // namespace

TEST_CASE("images of any size fit any other up to four times as large or small") {
    for (const Storage storage : {Storage::f32, Storage::f16}) {
        check_fit(random_image({3, 27, 171}), {171, 27}, storage);   // as it is
        check_fit(random_image({3, 27, 171}), {228, 36}, storage);   // 4/3
        check_fit(random_image({3, 27, 171}), {128, 20}, storage);   // 3/4, about
        check_fit(random_image({3, 27, 171}), {301, 19}, storage);   // up and down
        check_fit(random_image({3, 27, 171}), {117, 61}, storage);   // down and up
        check_fit(random_image({3, 27, 171}), {172, 26}, storage);   // by next to nothing
        check_fit(random_image({3, 27, 171}), {684, 108}, storage);  // the most
        check_fit(random_image({3, 28, 172}), {43, 7}, storage);     // the least
        check_fit(random_image({3, 27, 171}), {57, 9}, storage);     // whole blocks
        check_fit(random_image({3, 29, 271}), {68, 8}, storage);     // nearly the least
        check_fit(random_image({1, 5, 33}), {47, 9}, storage);
        check_fit(random_image({1, 29, 271}), {68, 41}, storage);
        check_fit(random_image({5, 9, 33}), {21, 4}, storage);
        check_fit(random_image({3, 18, 34}), {51, 7}, storage, 2);
        check_fit(random_image({3, 2, 5001}), {6999, 3}, storage);  // far from the origin as accurate as near it
        check_fit(random_image({3, 2, 6999}), {5003, 2}, storage);
    }
}

TEST_SUITE("small") {
    TEST_CASE("images of one pixel fit four, and the other way round") {
        for (const Storage storage : {Storage::f32, Storage::f16}) {
            check_fit(random_image({3, 1, 1}), {4, 3}, storage);
            check_fit(random_image({3, 4, 3}), {1, 1}, storage);
            check_fit(random_image({3, 1, 5}), {3, 2}, storage);
            check_fit(random_image({3, 3, 2}), {5, 1}, storage);
        }
    }

    TEST_CASE("what is not finite is what would be shown of it, and spoils no neighbour") {
        Planes image = random_image({3, 9, 14});
        constexpr float kInfinity = std::numeric_limits<float>::infinity();
        image.at(0, 3, 3) = std::numeric_limits<float>::quiet_NaN();
        image.at(1, 7, 5) = kInfinity;
        image.at(2, 0, 0) = -kInfinity;
        for (const Size size : {Size{23, 16}, {9, 5}, {20, 5}, {14, 9}}) check_fit(image, size, Storage::f32);
    }

    TEST_CASE("flats stay exactly flat, and an edge between two does not ring") {
        for (const Storage storage : {Storage::f32, Storage::f16}) {
            const Planes level = rounded(planes({3, 1, 1}, [](int c, int, int) { return 0.1f + 0.3f * c; }), storage);
            for (const Size size : {Size{70, 31}, {33, 50}, {90, 13}, {19, 8}, {51, 29}}) {
                const graph::Shape in{3, 29, 51}, out{3, size.height, size.width};
                const auto flat = [&](int c, int, int) { return level.at(c, 0, 0); };
                const runtime::Problem problem = problem_of(in, size, storage);
                check_operator(problem, {planes(in, flat)}, {}, planes(out, flat), 0);
                // Left of what the edge's pixels reach, and right of it.
                const auto edge = [&](int c, int x, int) { return x < 25 ? 0.0f : level.at(c, 0, 0); };
                for (const runtime::Implementation& implementation : runtime::implementations(problem.node)) {
                    const auto choices = implementation.choices(problem, {});
                    const Planes result =
                        run_operator(problem, implementation, choices.front(), {planes(in, edge)}, {});
                    for (int c = 0; c < 3; ++c)
                        for (int x = 0; x < size.width; ++x) {
                            const double left = static_cast<double>(x) * in.width / size.width;
                            const double right = (x + 1.0) * in.width / size.width;
                            const float value = result.at(c, x, size.height / 2);
                            CHECK(value >= 0);
                            CHECK(value <= level.at(c, 0, 0));
                            if (right < 24) CHECK(value == 0);
                            if (left > 26) CHECK(value == level.at(c, 0, 0));
                        }
                }
            }
        }
    }

    TEST_CASE("another size of image or result is no other program") {
        const auto options = [](graph::Shape in, Size size, const runtime::Implementation& implementation) {
            const runtime::Problem problem = problem_of(in, size, Storage::f32);
            return implementation.lower(problem, implementation.choices(problem, {}).front()).call.options;
        };
        for (const runtime::Implementation& implementation :
             runtime::implementations(problem_of({3, 9, 9}, {9, 9}, Storage::f32).node)) {
            const std::string larger = options({3, 540, 960}, {1280, 720}, implementation);
            CHECK(larger == options({3, 540, 970}, {2560, 1440}, implementation));
            const std::string smaller = options({3, 540, 960}, {640, 360}, implementation);
            CHECK(smaller == options({3, 541, 961}, {961, 400}, implementation));
            CHECK(larger != smaller);
        }
    }
}
