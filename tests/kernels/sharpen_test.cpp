#include <doctest/doctest.h>

#include <algorithm>

#include "operator_harness.h"

using namespace clarus;
using namespace clarus::test;
using runtime::Storage;

namespace {

void check_sharpening(Size size, float amount, Storage storage, int block = 1) {
    CAPTURE(amount);
    std::mt19937 random(2);
    const graph::Shape shape{3, size.height, size.width};
    const Planes image = rounded(random_planes(shape, random), storage);
    const Planes expected = planes(shape, [&](int c, int x, int y) {
        double sum = (1 + 4.0 * amount) * image.at(c, x, y);
        for (const int dy : {-1, 1})
            for (const int dx : {-1, 1})
                sum -=
                    amount * image.at(c, std::clamp(x + dx, 0, size.width - 1), std::clamp(y + dy, 0, size.height - 1));
        return static_cast<float>(std::clamp(sum, 0.0, 1.0));
    });
    runtime::Problem problem;
    problem.node = {graph::Sharpen{amount}, {}, shape, "sharpen"};
    problem.inputs = {part_layout(shape, storage, block, 4 * block * block, 0)};
    problem.output = pixel_layout(shape, storage);
    check_operator(problem, {image}, {}, expected, storage_tolerance(storage));
}

}  // namespace

TEST_CASE("sharpening subtracts the diagonal neighbours") {
    check_sharpening({31, 17}, 0.15f, Storage::f32);
    check_sharpening({31, 17}, 1, Storage::f16);
    check_sharpening({12, 8}, 0.15f, Storage::f32, 2);
    check_sharpening({9, 5}, 0, Storage::f32);
}

TEST_SUITE("small") {
    TEST_CASE("sharpening small images") {
        check_sharpening({1, 1}, 0.15f, Storage::f32);
        check_sharpening({2, 3}, 0.5f, Storage::f32);
    }
}
