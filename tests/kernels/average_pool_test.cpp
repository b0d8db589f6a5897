#include <doctest/doctest.h>

#include "operator_harness.h"

using namespace clarus;
using namespace clarus::test;
using runtime::Storage;

namespace {

void check_pooling(graph::Shape out, int scale, Storage storage, int block) {
    CAPTURE(scale);
    std::mt19937 random(6);
    const graph::Shape in{out.channels, out.height * scale, out.width * scale};
    const Planes image = rounded(random_planes(in, random), storage);
    const Planes expected = planes(out, [&](int c, int x, int y) {
        double sum = 0;
        for (int dy = 0; dy < scale; ++dy)
            for (int dx = 0; dx < scale; ++dx) sum += image.at(c, scale * x + dx, scale * y + dy);
        return static_cast<float>(sum / (scale * scale));
    });
    runtime::Problem problem;
    problem.node = {graph::AveragePool{scale}, {}, out, "pool"};
    problem.inputs = {part_layout(in, storage, block, in.channels * block * block + 3, 2)};
    problem.output = part_layout(out, storage, 1, out.channels + 5, 3);
    check_operator(problem, {image}, {}, expected, storage_tolerance(storage));
}

}  // namespace

TEST_CASE("an average pool is the mean of each square") {
    check_pooling({3, 7, 21}, 2, Storage::f32, 1);
    check_pooling({3, 5, 9}, 3, Storage::f16, 1);
    check_pooling({5, 6, 4}, 2, Storage::f32, 2);
}

TEST_SUITE("small") {
    TEST_CASE("an average pool to one pixel") { check_pooling({1, 1, 1}, 3, Storage::f32, 1); }
}
