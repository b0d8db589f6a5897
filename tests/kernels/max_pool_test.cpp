#include <doctest/doctest.h>

#include <algorithm>

#include "operator_harness.h"

using namespace clarus;
using namespace clarus::test;
using runtime::Storage;

namespace {

void check_pooling(graph::Shape in, Storage storage, int stride, int offset) {
    CAPTURE(in.channels);
    std::mt19937 random(6);
    const Planes image = rounded(random_planes(in, random, -1, 1), storage);
    const Planes expected = planes({in.channels, in.height / 2, in.width / 2}, [&](int c, int x, int y) {
        return std::max({image.at(c, 2 * x, 2 * y), image.at(c, 2 * x + 1, 2 * y), image.at(c, 2 * x, 2 * y + 1),
                         image.at(c, 2 * x + 1, 2 * y + 1)});
    });
    runtime::Problem problem;
    problem.node = {graph::MaxPool{}, {}, expected.shape, "max pooling"};
    problem.inputs = {part_layout(in, storage, 1, stride, offset)};
    problem.output = part_layout(expected.shape, storage, 1, in.channels + 5, 3);
    check_operator(problem, {image}, {}, expected, 0);
}

}  // namespace

TEST_CASE("max pooling takes the largest of every four pixels") {
    for (const Storage storage : {Storage::f32, Storage::f16}) {
        check_pooling({32, 18, 26}, storage, 32, 0);
        check_pooling({64, 6, 10}, storage, 96, 32);
        check_pooling({5, 14, 38}, storage, 9, 2);
    }
}

TEST_SUITE("small") {
    TEST_CASE("max pooling of small images") {
        check_pooling({3, 2, 2}, Storage::f32, 4, 0);
        check_pooling({16, 4, 2}, Storage::f16, 16, 0);
    }
}
