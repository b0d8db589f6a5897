#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

#include "convolution_harness.h"
#include "test_device.h"

using namespace clarus;
using namespace clarus::test;
using runtime::Storage;

namespace {

struct Case {
    int in_channels, out_channels;
    Size size;
    graph::Activation activation = graph::Activation::relu;
    Storage storage = Storage::f32;
    bool views = false;  // the images are parts of larger ones
    Size beyond{0, 0};   // what the input has more to the right and below
    int kernel = 3;
    int groups = 1, stride = 1;
};

runtime::Problem problem_of(const Case& test, const graph::Parameters& parameters) {
    const graph::Shape in{test.in_channels, test.size.height + test.beyond.height, test.size.width + test.beyond.width};
    const graph::Shape out{test.out_channels, (test.size.height + test.stride - 1) / test.stride,
                           (test.size.width + test.stride - 1) / test.stride};
    runtime::Problem problem;
    problem.node = {graph::Convolution{0, test.activation}, {}, out, "convolution"};
    problem.inputs = {test.views ? part_layout(in, test.storage, 1, in.channels + 7, 3)
                                 : pixel_layout(in, test.storage)};
    problem.output =
        test.views ? part_layout(out, test.storage, 1, out.channels + 9, 5) : pixel_layout(out, test.storage);
    problem.parameters = &parameters;
    return problem;
}

void check_convolution(const Case& test, bool all_choices = false) {
    CAPTURE(test.in_channels);
    CAPTURE(test.out_channels);
    CAPTURE(test.kernel);
    CAPTURE(test.size.width);
    CAPTURE(test.size.height);
    std::mt19937 random(7);
    const graph::Parameters parameters =
        random_parameters(test.out_channels, test.in_channels, test.kernel, 2, random, test.groups, test.stride);
    const runtime::Problem problem = problem_of(test, parameters);
    const Planes image = rounded(
        random_planes({test.in_channels, test.size.height + test.beyond.height, test.size.width + test.beyond.width},
                      random, -1, 1),
        test.storage);
    check_together([&] {
        for (const int set : {0, 1}) {
            const Planes expected = expected_convolution(image, parameters, set, test.activation, test.size);
            visit_implementations(problem, all_choices, [&](const auto& implementation, const auto& choices) {
                const float tolerance =
                    std::max(convolution_tolerance(implementation, choices), storage_tolerance(test.storage));
                check_result(problem, implementation, choices, {image}, {}, set,
                             [=](const Planes& result) { check_close(result, expected, tolerance); });
            });
        }
    });
}

/// The nearest bfloat16, of two the even one.
float in_bf16(float value) {
    const auto bits = std::bit_cast<std::uint32_t>(value);
    return std::bit_cast<float>((bits + 0x7fff + (bits >> 16 & 1)) & 0xffff0000);
}

/// Products of what is rounded to bfloat16 are exact in float.
void check_in_bf16(const Case& test) {
    CAPTURE(test.in_channels);
    CAPTURE(test.out_channels);
    CAPTURE(test.kernel);
    std::mt19937 random(8);
    const graph::Parameters parameters = random_parameters(test.out_channels, test.in_channels, test.kernel, 2, random);
    runtime::Problem problem = problem_of(test, parameters);
    problem.bf16 = true;
    const Planes image =
        rounded(random_planes({test.in_channels, test.size.height, test.size.width}, random, -1, 1), test.storage);
    graph::Parameters rounded_parameters = parameters;
    for (float& weight : rounded_parameters.weights) weight = in_bf16(weight);
    Planes rounded_image = image;
    for (float& value : rounded_image.values) value = in_bf16(value);
    bool ran = false;
    check_together([&] {
        for (const int set : {0, 1}) {
            const Planes expected =
                expected_convolution(rounded_image, rounded_parameters, set, test.activation, test.size);
            visit_implementations(problem, true, [&](const auto& implementation, const auto& choices) {
                if (implementation.name != "bf16") return;
                ran = true;
                check_result(problem, implementation, choices, {image}, {}, set, [=](const Planes& result) {
                    check_close(result, expected, std::max(1e-5f, storage_tolerance(test.storage)));
                });
            });
        }
    });
    CHECK(ran == test_device().profile().bf16);
}

}  // namespace

TEST_CASE("convolutions of ENSS's shapes") {
    check_convolution({22, 16, {37, 21}});
    check_convolution({16, 16, {37, 21}});
    check_convolution({16, 20, {37, 21}, graph::Activation::none});
    check_convolution({42, 32, {70, 9}});
    check_convolution({32, 45, {70, 9}, graph::Activation::none});
    check_convolution({64, 80, {13, 9}, graph::Activation::none});
}

TEST_CASE("convolutions with any number of channels") {
    check_convolution({1, 1, {37, 21}, graph::Activation::none});
    check_convolution({3, 5, {13, 9}});
    check_convolution({12, 33, {13, 9}});
    check_convolution({33, 3, {37, 21}});
    check_convolution({4, 28, {5, 3}, graph::Activation::none});
}

TEST_CASE("convolutions with kernels of any odd size") {
    for (const int kernel : {1, 5, 7, 9}) {
        check_convolution({3, 16, {37, 21}, graph::Activation::relu, Storage::f32, false, {}, kernel});
        check_convolution({18, 35, {19, 5}, graph::Activation::none, Storage::f16, true, {}, kernel});
    }
    check_convolution({16, 16, {61, 11}, graph::Activation::relu, Storage::f32, false, {}, 5}, true);
    check_convolution({16, 33, {61, 11}, graph::Activation::relu, Storage::f16, false, {}, 5}, true);
}

TEST_CASE("convolutions between views, and stored in half") {
    check_convolution({22, 20, {37, 21}, graph::Activation::none, Storage::f32, true});
    check_convolution({16, 45, {37, 21}, graph::Activation::relu, Storage::f16});
    check_convolution({5, 19, {13, 9}, graph::Activation::relu, Storage::f16, true});
}

TEST_CASE("convolutions of groups, and with strides") {
    check_convolution({6, 9, {23, 14}, graph::Activation::relu, Storage::f32, false, {0, 0}, 3, 3});
    check_convolution({8, 8, {23, 14}, graph::Activation::none, Storage::f16, true, {0, 0}, 5, 8});
    check_convolution({4, 6, {23, 14}, graph::Activation::relu, Storage::f32, false, {0, 0}, 3, 1, 2});
    check_convolution({4, 6, {22, 15}, graph::Activation::none, Storage::f32, true, {0, 0}, 5, 2, 3});
    check_convolution({3, 2, {7, 5}, graph::Activation::none, Storage::f32, false, {0, 0}, 1, 1, 2});
}

TEST_CASE("convolutions of NSRR's shapes, of which a part is wanted") {
    check_convolution({32, 3, {37, 21}, graph::Activation::none, Storage::f32, false, {3, 3}});
    check_convolution({60, 64, {13, 10}, graph::Activation::relu, Storage::f32, false, {1, 2}});
    check_convolution({96, 32, {12, 9}, graph::Activation::relu, Storage::f16});
    check_convolution({20, 32, {24, 13}});
    // NSRR's widest layers.
    for (const auto& [in, out] : {std::pair{96, 32}, {64, 128}, {128, 128}, {192, 64}})
        check_convolution({in, out, {13, 9}, graph::Activation::relu});
    check_convolution({32, 4, {24, 13}, graph::Activation::none});
}

TEST_CASE("every choice computes the same") {
    check_convolution({22, 52, {61, 11}}, true);
    check_convolution({16, 16, {61, 11}}, true);
    check_convolution({22, 52, {61, 11}, graph::Activation::relu, Storage::f16}, true);
}

TEST_CASE("convolutions in bfloat16, where the device has it") {
    check_in_bf16({22, 16, {37, 21}});
    check_in_bf16({16, 52, {70, 9}, graph::Activation::none, Storage::f32, true});
    check_in_bf16({3, 5, {13, 9}, graph::Activation::relu, Storage::f32, true});
    check_in_bf16({33, 20, {19, 5}, graph::Activation::relu, Storage::f16});
    for (const int kernel : {1, 5, 9})
        check_in_bf16({5, 16, {61, 11}, graph::Activation::none, Storage::f32, false, {}, kernel});
    check_in_bf16({1, 1, {1, 1}});
}

TEST_SUITE("small") {
    TEST_CASE("convolutions of small images") {
        check_convolution({3, 5, {1, 1}});
        check_convolution({22, 16, {7, 1}});
        check_convolution({16, 20, {9, 6}});
        check_convolution({3, 5, {2, 1}, graph::Activation::relu, Storage::f32, false, {}, 5});
    }
}

TEST_CASE("a value that is not finite spreads no farther than it must") {
    std::mt19937 random(9);
    const Case test{5, 20, {23, 14}, graph::Activation::none};
    const graph::Parameters parameters = random_parameters(test.out_channels, test.in_channels, test.kernel, 1, random);
    runtime::Problem problem = problem_of(test, parameters);
    problem.bf16 = true;
    const Planes clean = random_planes({test.in_channels, test.size.height, test.size.width}, random, -1, 1);
    const Planes expected = expected_convolution(clean, parameters, 0, test.activation, test.size);
    for (const float value : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
        Planes image = clean;
        const int bad_x = 9, bad_y = 6;
        image.at(2, bad_x, bad_y) = value;
        visit_implementations(problem, false, [&](const auto& implementation, const auto& choices) {
            Planes result = run_operator(problem, implementation, choices, {image}, {});
            // Winograd's tiles begin at multiples of four, and read one pixel around them.
            const bool tiles = implementation.name == "winograd";
            const auto touched = [&](int at, int bad) {
                return tiles ? bad >= at / 4 * 4 - 1 && bad <= at / 4 * 4 + 4 : std::abs(at - bad) <= 1;
            };
            for (int c = 0; c < test.out_channels; ++c) {
                for (int y = 0; y < test.size.height; ++y) {
                    for (int x = 0; x < test.size.width; ++x) {
                        if (std::abs(x - bad_x) <= 1 && std::abs(y - bad_y) <= 1)
                            CHECK_FALSE(std::isfinite(result.at(c, x, y)));
                        if (touched(x, bad_x) && touched(y, bad_y)) result.at(c, x, y) = expected.at(c, x, y);
                    }
                }
            }
            check_close(result, expected, implementation.name == "bf16" ? 2e-2f : 5e-5f);
        });
    }
}
