#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "convolution_harness.h"

using namespace clarus;
using namespace clarus::test;
using runtime::Storage;

namespace {

Rows within(Rows rows, int height) { return {std::clamp(rows.first, 0, height - 1), std::clamp(rows.end, 1, height)}; }

/// A layout whose pixels lie in larger cells, as those of a concat's part do.
runtime::TensorLayout part(graph::Shape shape, Storage storage) {
    return part_layout(shape, storage, 1, (shape.channels + 7) / 4 * 4, 3);
}

struct Layer {
    int in, out, kernel = 3, stride = 1;
    Storage storage = Storage::f32;
    int cropped = 0;  // rows and columns of the input that the result lacks
};

void check_convolution(const Layer& layer, Size size) {
    CAPTURE(layer.in);
    CAPTURE(layer.out);
    CAPTURE(layer.kernel);
    CAPTURE(layer.stride);
    std::mt19937 random(3);
    const graph::Parameters parameters =
        random_parameters(layer.out, layer.in, layer.kernel, 1, random, 1, layer.stride);

    const graph::Shape in{layer.in, size.height + layer.cropped, size.width + layer.cropped};
    const graph::Shape out{layer.out, (size.height + layer.stride - 1) / layer.stride,
                           (size.width + layer.stride - 1) / layer.stride};
    runtime::Problem problem;
    problem.node = {graph::Convolution{0, graph::Activation::relu}, {}, out, "convolution"};
    problem.inputs = {part(in, layer.storage)};
    problem.output = part(out, layer.storage);
    problem.parameters = &parameters;
    check_bands(
        problem, {random_planes(in, random, -1, 1)}, {},
        [&](int, int first, int end) {
            const int reach = layer.kernel / 2;
            return within({layer.stride * first - reach, layer.stride * (end - 1) + reach + 1}, in.height);
        },
        layer.storage == Storage::f16 ? 2e-3f : 2e-5f);
}

void check_upsampling(int channels, int scale, graph::Shift shift, float jitter) {
    CAPTURE(channels);
    CAPTURE(scale);
    CAPTURE(jitter);
    std::mt19937 random(4);
    const graph::Shape in{channels, 13, 11}, out{channels, 13 * scale, 11 * scale};
    runtime::FrameConstants frame;
    frame.jitter_x = frame.jitter_y = frame.motion_jitter_x = frame.motion_jitter_y = jitter;
    runtime::Problem problem;
    problem.node = {graph::Upsample{scale, shift}, {}, out, "upsample"};
    // Three channels are also upsampled as rows of four elements a pixel.
    problem.inputs = {channels <= 4 ? part_layout(in, Storage::f32, 1, 4, 0) : part(in, Storage::f32)};
    problem.output = part(out, Storage::f32);
    check_bands(
        problem, {random_planes(in, random)}, frame,
        [&](int, int first, int end) {
            const double shifted = shift == graph::Shift::none ? 0 : jitter;
            const auto tap = [&](int row) { return static_cast<int>(std::floor((row + 0.5) / scale - 0.5 - shifted)); };
            return within({tap(first), tap(end - 1) + 2}, in.height);
        },
        storage_tolerance(Storage::f32));
}

}  // namespace

TEST_CASE("convolutions work on bands of rows between rings") {
    check_convolution({20, 32}, {53, 29});
    check_convolution({8, 3, 3, 1, Storage::f16, 2}, {30, 17});
    check_convolution({5, 7, 5}, {19, 23});
    check_convolution({6, 4, 3, 2}, {21, 37});
}

TEST_CASE("convolutions of images put together work on bands of rows between rings") {
    std::mt19937 random(7);
    constexpr int kScale = 2, kHeight = 42;
    const graph::Shape out{18, kHeight, 22}, weighted{8, kHeight - 2, 20}, factor{1, kHeight - 2, 20},
        upsampled{16, kHeight / 2, 11}, pooled{4, 2 * kHeight, 44}, samples{5, kHeight / kScale, 11},
        zero_upsampled{5, kHeight, 22};
    const graph::Parameters parameters = random_parameters(out.channels, 8 + 16 + 4 + 5, 3, 1, random);
    using graph::Reading;
    const std::vector<Reading> readings{Reading::whole, Reading::factor, Reading::upsampled, Reading::pooled,
                                        Reading::whole};
    runtime::FrameConstants frame;
    frame.sample_y = 1;
    runtime::Problem problem;
    problem.node = {
        graph::Convolution{0, graph::Activation::relu, readings, out.width, out.height}, {}, out, "convolution"};
    for (const graph::Shape& shape : {weighted, factor, upsampled, pooled, zero_upsampled})
        problem.inputs.push_back(part(shape, Storage::f32));
    problem.inputs.back().samples = kScale;
    problem.output = part(out, Storage::f32);
    problem.parameters = &parameters;
    std::vector<Planes> images;
    for (const graph::Shape& shape : {weighted, factor, upsampled, pooled, samples})
        images.push_back(random_planes(shape, random, -1, 1));
    check_bands(
        problem, images, frame,
        [&](int input, int first, int end) {
            const Rows rows = within({first - 1, end + 1}, kHeight);
            switch (input) {
                case 2:
                    return within({(rows.first + 1) / 2 - 1, rows.end / 2 + 1}, upsampled.height);
                case 3:
                    return Rows{2 * rows.first, 2 * rows.end};
                case 4:
                    return Rows{rows.first / kScale, (rows.end + kScale - 1) / kScale};
                default:
                    return within(rows, weighted.height);
            }
        },
        5e-5f);
}

TEST_CASE("upsampling works on bands of rows between rings, whatever the jitter") {
    for (const int channels : {3, 18}) {
        for (const int scale : {2, 3}) {
            check_upsampling(channels, scale, graph::Shift::none, 0.5f);
            for (const float jitter : {-1.0f, 0.40625f, 1.0f})
                check_upsampling(channels, scale, graph::Shift::jitter, jitter);
        }
    }
    check_upsampling(3, 2, graph::Shift::motion_jitter, 0.71875f);
}

TEST_CASE("max pooling works on bands of rows between rings" * doctest::test_suite("small")) {
    std::mt19937 random(5);
    const graph::Shape in{19, 42, 14}, out{19, 21, 7};
    runtime::Problem problem;
    problem.node = {graph::MaxPool{}, {}, out, "pool"};
    problem.inputs = {part(in, Storage::f32)};
    problem.output = part(out, Storage::f32);
    check_bands(
        problem, {random_planes(in, random, -1, 1)}, {},
        [&](int, int first, int end) {
            return Rows{2 * first, 2 * end};
        },
        0);
}

TEST_CASE("rounding to numbers works on bands of rows between rings" * doctest::test_suite("small")) {
    std::mt19937 random(7);
    const graph::Shape shape{6, 21, 9};
    runtime::Problem problem;
    problem.node = {graph::Numbers{{0.01f, 100}}, {}, shape, "numbers"};
    problem.inputs = {part(shape, Storage::f32)};
    problem.output = part(shape, Storage::u8);
    check_bands(
        problem, {random_planes(shape, random, -2, 2)}, {},
        [&](int, int first, int end) {
            return Rows{first, end};
        },
        0);
}

TEST_CASE("pointwise programs work on bands of rows between rings, of smaller and zero-upsampled images too" *
          doctest::test_suite("small")) {
    std::mt19937 random(6);
    constexpr int kScale = 2;
    const graph::Shape smaller{3, 21, 13}, samples{3, 12, 8}, zero_upsampled{3, 24, 16}, out{6, 24, 16};
    runtime::FrameConstants frame;
    frame.sample_x = 1;
    runtime::Problem problem;
    problem.node = {graph::Pointwise{{{graph::Step::Function::tanh, {0}}}, {2, 1}}, {}, out, "pointwise"};
    problem.inputs = {part(smaller, Storage::f32), part(zero_upsampled, Storage::f32)};
    problem.inputs[1].samples = kScale;
    problem.output = part(out, Storage::f32);
    check_bands(
        problem, {random_planes(smaller, random), random_planes(samples, random)}, frame,
        [&](int input, int first, int end) {
            if (input == 0) return within({first, end}, smaller.height);
            return Rows{first / kScale, (end + kScale - 1) / kScale};
        },
        storage_tolerance(Storage::f32));
}
