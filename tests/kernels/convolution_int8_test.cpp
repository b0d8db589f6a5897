#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <vector>

#include "cl/context.h"
#include "convolution_harness.h"
#include "numbers.h"
#include "test_device.h"

using namespace clarus;
using namespace clarus::test;
using graph::Quantization;
using runtime::Storage;

namespace {

struct Case {
    int in_channels, out_channels;
    Size size;
    bool reads_bytes = true, makes_bytes = true;
    graph::Activation activation = graph::Activation::relu;
    Quantization input{0.031f, 77}, result{0.5f, 12};
    int kernel = 3, groups = 1, stride = 1;
    bool views = false;  // the images are parts of larger ones
    int largest_weight = 127;
    Storage images = Storage::f32;
};

graph::Parameters random_weights(const Case& test, std::mt19937& random, int sets) {
    graph::Parameters parameters{test.out_channels, test.in_channels, sets,       sets > 1,
                                 test.kernel,       test.groups,      test.stride};
    std::uniform_int_distribution<int> weight(-test.largest_weight, test.largest_weight), bias(-20000, 20000);
    std::uniform_real_distribution<float> scale(0.0005f, 0.02f);
    graph::QuantizedWeights& quantized = parameters.quantized.emplace(graph::QuantizedWeights{test.input});
    quantized.weights.resize(parameters.weights_per_set() * sets);
    for (std::int8_t& each : quantized.weights) each = static_cast<std::int8_t>(weight(random));
    for (int channel = 0; channel < sets * test.out_channels; ++channel) {
        quantized.biases.push_back(bias(random));
        quantized.scales.push_back(scale(random));
    }
    return parameters;
}

/// The convolution of numbers as it is defined, in whole numbers of 64 bits.
Planes expected(const Planes& image, const Case& test, const graph::Parameters& parameters, int set) {
    const graph::QuantizedWeights& weights = *parameters.quantized;
    const auto [channels, height, width] = image.shape;
    const int kernel = test.kernel, stride = test.stride, group = channels / test.groups;
    const graph::Shape shape{test.out_channels, (height + stride - 1) / stride, (width + stride - 1) / stride};
    return planes(shape, [&](int out, int x, int y) -> float {
        const size_t channel = static_cast<size_t>(set) * test.out_channels + out;
        std::int64_t sum = weights.biases[channel];
        const int first = out / (test.out_channels / test.groups) * group;
        for (int in = 0; in < group; ++in) {
            for (int tap = 0; tap < kernel * kernel; ++tap) {
                const int px = stride * x + tap % kernel - kernel / 2, py = stride * y + tap / kernel - kernel / 2;
                if (px < 0 || px >= width || py < 0 || py >= height) continue;
                sum += (static_cast<int>(image.at(first + in, px, py)) - test.input.zero_point) *
                       weights.weights[(channel * group + in) * kernel * kernel + tap];
            }
        }
        REQUIRE(std::abs(sum) <= std::numeric_limits<std::int32_t>::max());
        const bool relu = test.activation == graph::Activation::relu;
        if (!test.makes_bytes) {
            const float value = static_cast<float>(sum) * (test.input.scale * weights.scales[channel]);
            return relu ? std::max(value, 0.0f) : value;
        }
        const graph::Requantization by =
            graph::requantization(graph::requantization_factor(weights, channel, test.result));
        const int shift = 32 + by.shift;
        const std::int64_t number =
            ((sum * by.multiplier + (std::int64_t{1} << (shift - 1))) >> shift) + test.result.zero_point;
        return static_cast<float>(std::clamp<std::int64_t>(number, relu ? test.result.zero_point : 0, 255));
    });
}

runtime::TensorLayout layout(const Case& test, graph::Shape shape, bool bytes) {
    const Storage storage = bytes ? Storage::u8 : test.images;
    return test.views ? part_layout(shape, storage, 1, shape.channels + 7, 3) : pixel_layout(shape, storage);
}

runtime::Problem problem_of(const Case& test, const graph::Parameters& parameters) {
    const graph::Shape in{test.in_channels, test.size.height, test.size.width};
    const graph::Shape out{test.out_channels, (test.size.height + test.stride - 1) / test.stride,
                           (test.size.width + test.stride - 1) / test.stride};
    graph::Convolution convolution{0, test.activation};
    convolution.rounds = test.input;
    if (test.makes_bytes) convolution.result = test.result;
    runtime::Problem problem;
    problem.node = {convolution, {}, out, "convolution"};
    problem.inputs = {layout(test, in, test.reads_bytes)};
    problem.output = layout(test, out, test.makes_bytes);
    problem.parameters = &parameters;
    return problem;
}

Planes random_numbers(graph::Shape shape, std::mt19937& random) {
    std::uniform_int_distribution<int> number(0, 255);
    return planes(shape, [&](int, int, int) { return static_cast<float>(number(random)); });
}

/// Those for GPUs and DSPs run anywhere.
bool can_run(const runtime::Implementation& implementation, const runtime::Problem& problem,
             const DeviceProfile& profile) {
    const bool dense = problem.parameters->groups == 1 && problem.parameters->stride == 1;
    if (dense && (implementation.name == "int8 tiled" || implementation.name == "int8 streamed")) return true;
    return implementation.preference(problem, profile) > 0;
}

/// Of every implementation that can run it, by all its choices or the first.
void check(const Case& test, bool all_choices = false) {
    CAPTURE(test.in_channels);
    CAPTURE(test.out_channels);
    CAPTURE(test.kernel);
    CAPTURE(test.size.width);
    CAPTURE(test.size.height);
    std::mt19937 random(11);
    constexpr int kSets = 2;
    const graph::Parameters parameters = random_weights(test, random, kSets);
    const runtime::Problem problem = problem_of(test, parameters);
    const graph::Shape shape{test.in_channels, test.size.height, test.size.width};
    const Planes image =
        test.reads_bytes ? random_numbers(shape, random) : rounded(random_planes(shape, random, -3, 6), test.images);
    const Planes read = test.reads_bytes ? image : numbers(image, test.input);
    const DeviceProfile profile = test_device().profile();
    check_together([&] {
        for (int set = 0; set < kSets; ++set) {
            Planes result = expected(read, test, parameters, set);
            if (!test.makes_bytes) result = rounded(result, test.images);
            for (const runtime::Implementation& implementation : runtime::quantized_convolution_implementations()) {
                if (!can_run(implementation, problem, profile)) continue;
                CAPTURE(implementation.name);
                std::vector<runtime::Choices> choices = implementation.choices(problem, profile);
                if (!all_choices) choices.resize(std::min<size_t>(choices.size(), 1));
                for (const runtime::Choices& choice : choices)
                    check_result(problem, implementation, choice, {image}, {}, set,
                                 [=](const Planes& made) { check_close(made, result, 0); });
            }
        }
    });
}

Case with(Case test, bool reads_bytes, bool makes_bytes) {
    test.reads_bytes = reads_bytes;
    test.makes_bytes = makes_bytes;
    return test;
}

/// int8_products.clh, with the built-in function of cl_khr_integer_dot_product as it is defined where EMULATED.
constexpr const char* kProducts = R"(
#ifdef EMULATED
#ifndef cl_khr_integer_dot_product
#define cl_khr_integer_dot_product 1
#endif
#define dot_4x8packed_us_int emulated_dot
int emulated_dot(uint a, uint b) {
    const uchar4 numbers = as_uchar4(a);
    const char4 weights = as_char4(b);
    return numbers.x * weights.x + numbers.y * weights.y + numbers.z * weights.z + numbers.w * weights.w;
}
#endif
#include "int8_products.clh"
kernel void products(global int* sums, global const uint* numbers, global const int* weights) {
    const int i = get_global_id(0);
    vstore16(add_products(vload16(i, sums), numbers[i], vload16(i, weights)), i, sums);
}
)";

/// What int8_products.clh makes of sums, 16 a word of numbers.
std::vector<std::int32_t> with_products(const std::string& options, std::vector<std::int32_t> sums,
                                        std::vector<std::uint32_t> numbers, std::vector<std::int32_t> weights) {
    ocl::Context& context = test_device().context();
    const auto buffer = [&](auto& values) {
        return cl::Buffer(context.context(), CL_MEM_COPY_HOST_PTR, 4 * values.size(), values.data());
    };
    const cl::Buffer of_sums = buffer(sums), of_numbers = buffer(numbers), of_weights = buffer(weights);
    cl::Kernel kernel(context.program_from_source("products.cl", kProducts, options), "products");
    kernel.setArg(0, of_sums);
    kernel.setArg(1, of_numbers);
    kernel.setArg(2, of_weights);
    context.queue().enqueueNDRangeKernel(kernel, cl::NullRange, cl::NDRange(numbers.size()));
    context.queue().enqueueReadBuffer(of_sums, CL_TRUE, 0, 4 * sums.size(), sums.data());
    return sums;
}

}  // namespace

TEST_CASE("convolutions in whole numbers are those of the definition, number for number") {
    check_together([] {
        for (const bool reads_bytes : {false, true})
            for (const bool makes_bytes : {false, true}) check(with({22, 20, {37, 9}}, reads_bytes, makes_bytes));
        check({16, 16, {61, 11}}, true);
        check({16, 8, {61, 6}, true, false, graph::Activation::none}, true);
        check({32, 45, {29, 5}}, true);
        check({5, 3, {13, 9}, true, true, graph::Activation::none});
        check({64, 37, {13, 5}});
    });
}

TEST_CASE("convolutions in whole numbers with kernels of other sizes, groups and strides") {
    check_together([] {
        for (const int kernel : {1, 5}) {
            Case test{18, 16, {19, 7}};
            test.kernel = kernel;
            test.largest_weight = 40;
            check(with(test, kernel == 5, true));
        }
        Case strides{6, 9, {23, 14}};
        strides.stride = 2;
        check(with(strides, false, false));
        strides.groups = 3;
        check(strides);
    });
}

TEST_CASE("convolutions in whole numbers between views, and of images in half") {
    check_together([] {
        Case test{12, 20, {37, 9}};
        test.views = true;
        check(test);
        test.images = Storage::f16;
        check(with(test, false, false));
        check(with(test, false, true));
    });
}

TEST_CASE("convolutions in whole numbers put their input together from images, rounded as they are read") {
    constexpr int kScale = 2;
    const Size size{22, 10};
    const graph::Shape whole{8, size.height, size.width}, pooled{4, 2 * size.height, 2 * size.width};
    const graph::Shape sampled{6, size.height, size.width};
    const graph::Shape samples{6, size.height / kScale, size.width / kScale};
    Case test{18, 20, size};
    std::mt19937 random(6);
    const graph::Parameters parameters = random_weights(test, random, 1);
    runtime::FrameConstants frame;
    frame.sample_x = 1;
    runtime::Problem problem = problem_of(test, parameters);
    auto& convolution = std::get<graph::Convolution>(problem.node.op);
    convolution.readings = {graph::Reading::whole, graph::Reading::pooled, graph::Reading::whole};
    convolution.width = size.width;
    convolution.height = size.height;
    problem.inputs = {pixel_layout(whole, Storage::f32), pixel_layout(pooled, Storage::f32),
                      pixel_layout(sampled, Storage::f32)};
    problem.inputs.back().samples = kScale;
    const std::vector<Planes> images{random_planes(whole, random, -2, 4), random_planes(pooled, random, -2, 4),
                                     random_planes(samples, random, -2, 4)};
    const Planes read = planes({test.in_channels, size.height, size.width}, [&](int c, int x, int y) -> float {
        if (c < 8) return images[0].at(c, x, y);
        if (c < 12) {
            const auto row = [&](int py) {
                return std::max(images[1].at(c - 8, 2 * x, py), images[1].at(c - 8, 2 * x + 1, py));
            };
            return std::max(row(2 * y), row(2 * y + 1));
        }
        const bool is_sample = x % kScale == frame.sample_x && y % kScale == frame.sample_y;
        return is_sample ? images[2].at(c - 12, x / kScale, y / kScale) : 0;
    });
    check_operator(problem, images, frame, expected(numbers(read, test.input), test, parameters, 0), 0);
}

TEST_CASE("convolutions in whole numbers work on bands of rows, in rings") {
    for (const bool reads_bytes : {false, true}) {
        const Case test = with({16, 20, {37, 29}}, reads_bytes, true);
        std::mt19937 random(8);
        const graph::Parameters parameters = random_weights(test, random, 1);
        const graph::Shape in{test.in_channels, test.size.height, test.size.width};
        const Planes image = reads_bytes ? random_numbers(in, random) : random_planes(in, random, -3, 6);
        check_bands(
            problem_of(test, parameters), {image}, {},
            [&](int, int first, int end) {
                return Rows{std::max(first - 1, 0), std::min(end + 1, test.size.height)};
            },
            0);
    }
}

TEST_CASE("sums that floats cannot count to are left to other kernels") {
    const Case test{64, 16, {19, 5}};
    std::mt19937 random(5);
    graph::Parameters parameters = random_weights(test, random, 1);
    for (std::int8_t& weight : parameters.quantized->weights) weight = 127;
    const runtime::Problem problem = problem_of(test, parameters);
    const Planes image = planes({64, 5, 19}, [](int, int, int) { return 255; });
    const Planes result = expected(image, test, parameters, 0);
    for (const runtime::Implementation& implementation : runtime::quantized_convolution_implementations())
        if (implementation.name == "int8 in float")
            CHECK(implementation.preference(problem, test_device().profile()) == 0);
    check_operator(problem, {image}, {}, result, 0);
}

TEST_CASE("numbers saturate, and zero points lie at both ends") {
    check_together([] {
        for (const int zero_point : {0, 255}) {
            Case test{8, 18, {19, 5}};
            test.activation = zero_point == 0 ? graph::Activation::none : graph::Activation::relu;
            test.input.zero_point = zero_point;
            test.result = {0.01f, 255 - zero_point};  // far less than the sums need
            check(test);
            check(with(test, false, true));
        }
    });
}

TEST_SUITE("small") {
    TEST_CASE("convolutions in whole numbers of small images") {
        check({3, 5, {1, 1}});
        check(with({22, 16, {7, 1}}, false, true));
        check(with({4, 20, {9, 6}}, true, false));
    }

    TEST_CASE("what is not finite has a number, and halves go to even ones") {
        constexpr float kInfinity = std::numeric_limits<float>::infinity();
        Case test{4, 4, {3, 2}, false, false, graph::Activation::none};
        test.kernel = 1;
        test.input = {0.5f, 100};
        std::mt19937 random(3);
        graph::Parameters parameters = random_weights(test, random, 1);
        graph::QuantizedWeights& weights = *parameters.quantized;
        for (int channel = 0; channel < 4; ++channel) {
            weights.biases[channel] = 0;
            weights.scales[channel] = 2;
            for (int in = 0; in < 4; ++in) weights.weights[4 * channel + in] = in == channel;
        }
        const float values[] = {std::numeric_limits<float>::quiet_NaN(), kInfinity, -kInfinity, 0.25f, 0.75f, -0.25f};
        const float read_as[] = {-100, 155, -100, 0, 2, 0};
        const Planes image = planes({4, 2, 3}, [&](int, int x, int y) { return values[3 * y + x]; });
        const Planes result = planes({4, 2, 3}, [&](int, int x, int y) { return read_as[3 * y + x]; });
        check_operator(problem_of(test, parameters), {image}, {}, result, 0);
    }

    TEST_CASE("four products at once, also by the built-in function of devices that have it") {
        constexpr int kWords = 37;
        std::mt19937 random(11);
        std::vector<std::uint32_t> numbers{0, 0xffffffff, 0x80ff0001};
        std::vector<std::int32_t> weights, sums, expected;
        while (numbers.size() < kWords) numbers.push_back(random());
        for (int i = 0; i < 16 * kWords; ++i) {
            weights.push_back(i < 20 ? 0x7f80ff01 : static_cast<std::int32_t>(random()));
            sums.push_back(static_cast<std::int32_t>(random()) / 2);
            std::int32_t sum = sums[i];
            for (int part = 0; part < 32; part += 8)
                sum +=
                    static_cast<std::uint8_t>(numbers[i / 16] >> part) * static_cast<std::int8_t>(weights[i] >> part);
            expected.push_back(sum);
        }
        CHECK(with_products("", sums, numbers, weights) == expected);
        const bool has = test_device().profile().int8_dot_product;
        CHECK(with_products(has ? "-DDOT" : "-DDOT -DEMULATED", sums, numbers, weights) == expected);
    }

    TEST_CASE("a factor as a whole multiplier") {
        for (const double factor : {0.2499999999, 0.1, 0.125, 3.7e-3, 1e-6, 2.4e-10, 1e-12, 0.0}) {
            CAPTURE(factor);
            const graph::Requantization by = graph::requantization(factor);
            CHECK(by.shift >= 1);
            CHECK(by.shift <= 30);
            CHECK(by.multiplier >= 0);
            const double error = std::abs(std::ldexp(by.multiplier, -32 - by.shift) - factor);
            CHECK(error <= std::max(factor * std::ldexp(1, -30), std::ldexp(1, -63)));
        }
    }
}
