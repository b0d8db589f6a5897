#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "operator_harness.h"

using namespace clarus;
using namespace clarus::test;
using graph::Step;
using runtime::Storage;

namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

/// Channel c of a step's result, of the channels of its operands.
double evaluate(const Step& step, int c, const std::vector<std::vector<double>>& operands) {
    const auto operand = [&](int index) {
        const std::vector<double>& channels = operands[step.operands[index]];
        return channels.size() == 1 ? channels[0] : channels[c];
    };
    const auto group = [&](int index) {
        const std::vector<double>& channels = operands[step.operands[0]];
        const size_t size = channels.size() / step.groups;
        return std::vector<double>(channels.begin() + index * size, channels.begin() + (index + 1) * size);
    };
    switch (step.function) {
        case Step::Function::sigmoid:
            return std::isnan(operand(0)) ? 0 : 1 / (1 + std::exp(-operand(0)));
        case Step::Function::mix:
            return operand(2) * operand(0) + (1 - operand(2)) * operand(1);
        case Step::Function::clamp:
            return operand(0) > step.low ? std::min<double>(operand(0), step.high) : step.low;
        case Step::Function::tanh:
            return std::isnan(operand(0)) ? -1 : std::tanh(operand(0));
        case Step::Function::prelu:
            return operand(0) > 0 ? operand(0) : step.coefficients[c] * operand(0);
        case Step::Function::round:
            return std::floor(operand(0) + 0.5);
        case Step::Function::sum:
            return operand(0) + operand(1);
        case Step::Function::difference:
            return std::abs(operand(0) - operand(1));
        case Step::Function::minimum:
            return operand(0) < operand(1) ? operand(0) : operand(1);
        case Step::Function::maximum:
            return operand(0) > operand(1) ? operand(0) : operand(1);
        case Step::Function::product:
            return operand(0) * operand(1);
        case Step::Function::linear: {
            double sum = step.addend;
            for (size_t i = 0; i < step.operands.size(); ++i)
                sum += step.coefficients[i] * operand(static_cast<int>(i));
            return sum;
        }
        case Step::Function::softmax: {
            const auto members = group(c * step.groups / static_cast<int>(operands[step.operands[0]].size()));
            double total = 0;
            for (const double member : members) total += std::exp(member - operand(0));
            return 1 / total;
        }
        case Step::Function::channel_maximum: {
            const auto members = group(c);
            return *std::max_element(members.begin(), members.end());
        }
        case Step::Function::channel_sum: {
            const auto members = group(c);
            return std::accumulate(members.begin(), members.end(), 0.0);
        }
    }
    return kNan;
}

int channels_of(const Step& step, const std::vector<int>& channels) {
    if (step.function == Step::Function::channel_maximum || step.function == Step::Function::channel_sum)
        return step.groups;
    int most = 1;
    for (const int operand : step.operands) most = std::max(most, channels[operand]);
    return most;
}

Planes expected_pointwise(const graph::Pointwise& program, const std::vector<Planes>& inputs) {
    std::vector<int> channels;
    for (const Planes& input : inputs) channels.push_back(input.shape.channels);
    for (const Step& step : program.steps) channels.push_back(channels_of(step, channels));
    graph::Shape shape = inputs[0].shape;
    std::vector<std::pair<int, int>> results;  // operand and its channel
    for (const int result : program.results)
        for (int c = 0; c < channels[result]; ++c) results.emplace_back(result, c);
    shape.channels = static_cast<int>(results.size());

    return planes(shape, [&](int channel, int x, int y) {
        std::vector<std::vector<double>> values;
        for (const Planes& input : inputs) {
            values.emplace_back();
            for (int c = 0; c < input.shape.channels; ++c) values.back().push_back(input.at(c, x, y));
        }
        for (const Step& step : program.steps) {
            std::vector<double> result;
            for (int c = 0; c < channels[values.size()]; ++c) result.push_back(evaluate(step, c, values));
            values.push_back(std::move(result));
        }
        const auto [result, c] = results[channel];
        return static_cast<float>(values[result][c]);
    });
}

struct Operand {
    int channels;
    int block;
    int stride, offset;
    Storage storage = Storage::f32;
};

void check_pointwise(const graph::Pointwise& program, const std::vector<Planes>& images,
                     const std::vector<Operand>& operands, const Operand& result, float tolerance) {
    runtime::Problem problem;
    std::vector<Planes> inputs;
    for (size_t i = 0; i < images.size(); ++i) {
        const Operand& operand = operands[i];
        inputs.push_back(rounded(images[i], operand.storage));
        problem.inputs.push_back(
            part_layout(images[i].shape, operand.storage, operand.block, operand.stride, operand.offset));
    }
    const Planes expected = expected_pointwise(program, inputs);
    REQUIRE(expected.shape.channels == result.channels);
    problem.node = {program, {}, expected.shape, "pointwise"};
    problem.output = part_layout(expected.shape, result.storage, result.block, result.stride, result.offset);
    check_operator(problem, inputs, {}, expected, tolerance);
}

/// ENSS's last steps: α, candidate, feature and warped history make the new state.
const graph::Pointwise kBlend{
    {{Step::Function::sigmoid, {0}}, {Step::Function::mix, {1, 3, 4}}, {Step::Function::clamp, {5}, 0, 1}}, {6, 2}};

void check_blend(int width, int height, int scale, Storage network, Storage history, int state_stride) {
    CAPTURE(scale);
    std::mt19937 random(8);
    const int hr_width = width * scale, hr_height = height * scale, square = scale * scale;
    const std::vector<Planes> images = {random_planes({1, hr_height, hr_width}, random, -9, 9),
                                        random_planes({3, hr_height, hr_width}, random, -0.3f, 1.3f),
                                        random_planes({1, hr_height, hr_width}, random, -2, 2),
                                        random_planes({3, hr_height, hr_width}, random)};
    check_pointwise(kBlend, images,
                    {{1, scale, 5 * square, 0, network},
                     {3, scale, 5 * square, square, network},
                     {1, scale, 5 * square, 4 * square, network},
                     {3, scale, 6 + 4 * square, 6, history}},
                    {4, 1, state_stride, 0, history}, storage_tolerance(history));
}

}  // namespace

TEST_CASE("a blend of blocks into pixels") {
    check_blend(21, 13, 2, Storage::f32, Storage::f32, 4);
    check_blend(21, 13, 2, Storage::f16, Storage::f16, 4);
    check_blend(9, 7, 3, Storage::f32, Storage::f32, 4);
    check_blend(10, 5, 4, Storage::f32, Storage::f16, 6);
}

TEST_CASE("the sigmoid is accurate, and a number whatever it is given") {
    const graph::Shape shape{1, 2, 4001};
    Planes images =
        planes(shape, [](int, int x, int y) { return static_cast<float>(x - 2000) * (y ? 0.05f : 0.005f); });
    images.values[0] = kNan;
    images.values[1] = std::numeric_limits<float>::infinity();
    images.values[2] = -std::numeric_limits<float>::infinity();
    images.values[3] = 1e30f;
    images.values[4] = -1e30f;
    const graph::Pointwise sigmoid{{{Step::Function::sigmoid, {0}}}, {1}};
    check_pointwise(sigmoid, {images}, {{1, 1, 1, 0}}, {1, 1, 1, 0}, 1e-6f);

    images.shape = {1, 2, 4000};
    images.values.resize(8000);
    check_pointwise(sigmoid, {images}, {{1, 2, 4, 0}}, {1, 2, 8, 4}, 1e-6f);
}

TEST_CASE("the hyperbolic tangent is accurate, and a number whatever it is given") {
    Planes images = planes({1, 2, 4001}, [](int, int x, int y) { return (x - 2000) * (y ? 0.05f : 0.005f); });
    images.values[0] = kNan;
    images.values[1] = std::numeric_limits<float>::infinity();
    images.values[2] = -1e30f;
    check_pointwise({{{Step::Function::tanh, {0}}}, {1}}, {images}, {{1, 1, 1, 0}}, {1, 1, 1, 0}, 2e-6f);
}

TEST_CASE("linear combinations of images, times an image of one channel") {
    std::mt19937 random(3);
    const std::vector<Planes> images = {random_planes({3, 8, 10}, random), random_planes({3, 8, 10}, random),
                                        random_planes({1, 8, 10}, random, -3, 3)};
    const graph::Pointwise program{
        {{Step::Function::linear, {0, 1}, 0, 0, {0.25f, -1.5f}, 0.5f}, {Step::Function::product, {3, 2}}}, {4, 0}};
    check_pointwise(program, images, {{3, 1, 3, 0}, {3, 1, 8, 5}, {1, 1, 4, 2}}, {6, 1, 12, 3}, 1e-6f);
    check_pointwise(program, images, {{3, 2, 12, 0}, {3, 1, 3, 0}, {1, 1, 1, 0}}, {6, 2, 24, 0}, 1e-6f);
}

void check_gathering(int scale, graph::Shape render, Size whole, Storage storage, bool previous) {
    CAPTURE(scale);
    CAPTURE(previous);
    std::mt19937 random(2);
    const graph::Shape output{render.channels, render.height * scale, render.width * scale};
    const Planes samples = rounded(random_planes(render, random), storage);
    const Planes image = rounded(random_planes(output, random), storage);
    runtime::FrameConstants frame;
    frame.sample_x = frame.previous_sample_y = scale - 1;
    const int qx = previous ? frame.previous_sample_x : frame.sample_x;
    const int qy = previous ? frame.previous_sample_y : frame.sample_y;
    const Planes expected = planes({2 * render.channels, whole.height, whole.width}, [&](int c, int x, int y) -> float {
        x = std::min(x, output.width - 1);
        y = std::min(y, output.height - 1);
        if (c >= render.channels) return image.at(c - render.channels, x, y);
        return x % scale == qx && y % scale == qy ? samples.at(c, x / scale, y / scale) : 0;
    });
    runtime::Problem problem;
    problem.node = {graph::Pointwise{{}, {0, 1}}, {}, expected.shape, "gather"};
    problem.inputs = {part_layout(output, storage, 1, render.channels + 5, 3), pixel_layout(output, storage)};
    problem.inputs[0].samples = scale;
    problem.inputs[0].previous_samples = previous;
    problem.output = pixel_layout(expected.shape, storage);
    check_operator(problem, {samples, image}, frame, expected, 0);
}

TEST_CASE("zero-upsampled and smaller images are read where they have something") {
    check_gathering(4, {12, 7, 5}, {20, 28}, Storage::f32, false);
    check_gathering(3, {3, 5, 7}, {24, 16}, Storage::f32, true);
    check_gathering(2, {4, 3, 37}, {76, 8}, Storage::f16, false);
}

/// A colour held between tiles' limits, the first of which is a NaN.
void check_tiles(graph::Shape render, int scale, int block, Storage storage) {
    CAPTURE(scale);
    CAPTURE(block);
    std::mt19937 random(4);
    const graph::Shape output{render.channels, render.height * scale, render.width * scale};
    const Planes low = rounded(random_planes(render, random, -1, 0), storage);
    const Planes high = rounded(random_planes(render, random, 0, 1), storage);
    Planes image = rounded(random_planes(output, random, -2, 2), storage);
    image.values[0] = kNan;
    const Planes expected = planes(output, [&](int c, int x, int y) {
        const float least = low.at(c, x / scale, y / scale), value = image.at(c, x, y);
        return std::isnan(value) ? least : std::clamp(value, least, high.at(c, x / scale, y / scale));
    });
    runtime::Problem problem;
    problem.node = {
        graph::Pointwise{{{Step::Function::maximum, {0, 1}}, {Step::Function::minimum, {3, 2}}}, {4}}, {}, output, ""};
    problem.inputs = {part_layout(output, storage, block, 4 * block * block, 1), part_layout(output, storage, 1, 8, 0),
                      part_layout(output, storage, 1, 8, 3)};
    for (int i : {1, 2}) {
        problem.inputs[i].samples = scale;
        problem.inputs[i].tiled = true;
    }
    problem.output = part_layout(output, storage, block, 5 * block * block, 0);
    check_operator(problem, {image, low, high}, {}, expected, 0);
    problem.output = pixel_layout(output, storage);
    check_operator(problem, {image, low, high}, {}, expected, 0);
}

TEST_CASE("tiles are read as the pixels that they are made of") {
    for (const Storage storage : {Storage::f32, Storage::f16}) {
        check_tiles({3, 5, 7}, 2, 1, storage);
        check_tiles({3, 5, 7}, 2, 2, storage);
        check_tiles({4, 3, 71}, 2, 2, storage);
        check_tiles({3, 4, 9}, 3, 3, storage);
        check_tiles({3, 3, 5}, 4, 2, storage);
        check_tiles({3, 1, 1}, 3, 1, storage);
    }
}

TEST_CASE("a clamp lets no NaN through") {
    Planes images = planes({4, 6, 8}, [](int c, int x, int y) { return static_cast<float>(x - y) * 0.3f + c; });
    images.values[0] = images.values[50] = images.values[190] = kNan;
    images.values[1] = std::numeric_limits<float>::infinity();
    images.values[60] = -std::numeric_limits<float>::infinity();
    const graph::Pointwise clamp{{{Step::Function::clamp, {0}, -0.25f, 0.7f}}, {1}};
    check_pointwise(clamp, {images}, {{4, 1, 4, 0}}, {4, 1, 5, 1}, 1e-6f);
    check_pointwise(clamp, {images}, {{4, 1, 4, 0}}, {4, 2, 24, 3}, 1e-6f);
    check_pointwise(clamp, {images}, {{4, 2, 16, 0}}, {4, 2, 16, 0}, 1e-6f);
}

TEST_CASE("sums, differences and roundings of images") {
    std::mt19937 random(5);
    const std::vector<Planes> images = {random_planes({3, 12, 24}, random, -3, 3),
                                        random_planes({3, 12, 24}, random, -3, 3)};
    const graph::Pointwise program{
        {{Step::Function::sum, {0, 1}}, {Step::Function::difference, {2, 1}}, {Step::Function::round, {0}}}, {2, 3, 4}};
    check_pointwise(program, images, {{3, 1, 3, 0}, {3, 2, 12, 0}}, {9, 1, 10, 1}, 1e-6f);
}

TEST_CASE("layers of a stack, between all layouts") {
    std::mt19937 random(5);
    const std::vector<Planes> images = {random_planes({6, 12, 24}, random, -3, 3),
                                        random_planes({1, 12, 24}, random, -3, 3)};
    Step softmax{Step::Function::softmax, {0}}, maximum{Step::Function::channel_maximum, {1}},
        sum{Step::Function::channel_sum, {1}};
    softmax.groups = 2;
    maximum.groups = sum.groups = 3;
    const graph::Pointwise program{{softmax,
                                    {Step::Function::prelu, {0}, 0, 0, {0.25f, 0, -1, 1, 0.5f, 2}},
                                    {Step::Function::product, {2, 1}},
                                    {Step::Function::tanh, {4}},
                                    {Step::Function::linear, {0, 5, 3}, 0, 0, {0.5f, -2, 1}, 0.125f}},
                                   {2, 3, 5, 6}};
    const graph::Pointwise reductions{{softmax, maximum, sum}, {2, 3}};
    for (const Storage storage : {Storage::f32, Storage::f16}) {
        const float tolerance = storage == Storage::f16 ? 2e-3f : 4e-6f;
        for (const int block : {1, 2, 3}) {
            const int square = block * block;
            const std::vector<Operand> from{{6, block, 6 * square + 5, 2, storage}, {1, 1, 4, 1, storage}};
            check_pointwise(program, images, from, {24, 1, 24, 0, storage}, tolerance);
            check_pointwise(program, images, from, {24, block, 24 * square, 0, storage}, tolerance);
            check_pointwise(reductions, {images[0]}, {from[0]}, {6, 1, 7, 0, storage}, tolerance);
        }
    }
}

TEST_CASE("a softmax of large values is one of small ones") {
    Planes images = planes({4, 3, 5}, [](int c, int x, int y) { return 1e4f * (c - x % 3) - 300 * y; });
    const graph::Pointwise softmax{{{Step::Function::softmax, {0}}}, {1}};
    check_pointwise(softmax, {images}, {{4, 1, 4, 0}}, {4, 1, 4, 0}, 1e-6f);
}

TEST_CASE("a program without steps copies between layouts and storages") {
    std::mt19937 random(4);
    const Planes images = random_planes({3, 12, 24}, random, -3, 3);
    const graph::Pointwise copy{{}, {0}};
    check_pointwise(copy, {images}, {{3, 1, 3, 0, Storage::f16}}, {3, 4, 50, 2, Storage::f32}, 0);
    check_pointwise(copy, {images}, {{3, 3, 30, 1, Storage::f32}}, {3, 1, 8, 5, Storage::f32}, 0);
    check_pointwise(copy, {images}, {{3, 4, 48, 0, Storage::f16}}, {3, 2, 12, 0, Storage::f16}, 0);
}

TEST_CASE("what half cannot hold is stored as the most that it can") {
    Planes images = planes({2, 6, 8}, [](int c, int x, int y) { return 1e5f * (c - 0.5f) * x - y; });
    images.values[0] = std::numeric_limits<float>::infinity();
    Planes expected = images;
    for (float& value : expected.values) value = std::clamp(value, -65504.0f, 65504.0f);
    const graph::Pointwise copy{{}, {0}};
    for (const int block : {1, 2}) {
        runtime::Problem problem;
        problem.inputs = {part_layout(images.shape, Storage::f32, block, 2 * block * block, 0)};
        problem.output = part_layout(images.shape, Storage::f16, block, 2 * block * block, 0);
        problem.node = {copy, {0}, images.shape, "copy"};
        check_operator(problem, {images}, {}, expected, 1e-3f);
    }
}

TEST_SUITE("small") {
    TEST_CASE("pointwise programs on small images") {
        check_blend(1, 1, 2, Storage::f32, Storage::f32, 4);
        check_blend(3, 2, 3, Storage::f16, Storage::f16, 4);
        check_gathering(5, {2, 1, 1}, {8, 8}, Storage::f32, false);
    }
}
