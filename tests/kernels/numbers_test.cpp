// An image as numbers of a byte (docs/quantization.md, "Arithmetic"), to the bit.

#include "numbers.h"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>

using namespace clarus;
using namespace clarus::test;
using runtime::Storage;

namespace {

void check_numbers(graph::Shape shape, Storage storage, int block, int stride, int offset,
                   const graph::Quantization& quantization) {
    CAPTURE(shape.channels);
    CAPTURE(quantization.zero_point);
    std::mt19937 random(3);
    Planes image = random_planes(shape, random, -3, 3);
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    const float special[] = {NAN, kInfinity, -kInfinity, 0.5f * quantization.scale, 1.5f * quantization.scale, -0.0f};
    for (size_t i = 0; i < std::min(std::size(special), image.values.size()); ++i)
        image.values[i * 7 % image.values.size()] = special[i];
    image = rounded(image, storage);
    runtime::Problem problem;
    problem.node = {graph::Numbers{quantization}, {}, shape, "numbers"};
    problem.inputs = {part_layout(shape, storage, block, stride, offset)};
    problem.output = part_layout(shape, Storage::u8, 1, shape.channels + 5, 3);
    check_operator(problem, {image}, {}, numbers(image, quantization), 0);
}

}  // namespace

TEST_CASE("an image is rounded to numbers as convolutions in whole numbers round it") {
    for (const Storage storage : {Storage::f32, Storage::f16}) {
        check_numbers({3, 37, 71}, storage, 1, 4, 0, {0.0117f, 128});
        check_numbers({32, 18, 26}, storage, 1, 40, 8, {0.02f, 0});
        check_numbers({6, 20, 34}, storage, 2, 24, 0, {0.5f, 255});
    }
}

TEST_SUITE("small") {
    TEST_CASE("small images are rounded to numbers") {
        check_numbers({3, 1, 1}, Storage::f32, 1, 4, 0, {0.02f, 17});
        check_numbers({5, 3, 2}, Storage::f16, 1, 9, 2, {1e-3f, 200});
        check_numbers({1, 4, 5}, Storage::f32, 1, 4, 1, {3, 1});
    }
}
