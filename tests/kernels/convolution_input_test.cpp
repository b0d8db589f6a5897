#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "convolution_harness.h"

using namespace clarus;
using namespace clarus::test;
using graph::Reading;
using runtime::Storage;

namespace {

struct Place {
    int x, y;
};

enum class Kind { whole, weighted, pooled, upsampled, samples };

/// An image that a convolution's input is made of.
struct Part {
    Kind kind;
    int channels;
    bool of_larger = false;  // stored as a part of larger pixels
};

struct Case {
    Size input;
    std::vector<Part> parts;
    int out_channels;
    Storage storage = Storage::f32;
    int scale = 4;      // of samples
    Size margin{0, 0};  // what the input has more than its images to the right and below
    int kernel = 3;
    Place sample{1, 2};  // where in its block it is
};

/// What is stored of a part.
graph::Shape stored_shape(const Case& test, const Part& part) {
    const int width = test.input.width - test.margin.width, height = test.input.height - test.margin.height;
    switch (part.kind) {
        case Kind::pooled:
            return {part.channels, 2 * test.input.height, 2 * test.input.width};
        case Kind::upsampled:
            return {part.channels, test.input.height / 2, test.input.width / 2};
        case Kind::samples:
            return {part.channels, height / test.scale, width / test.scale};
        case Kind::whole:
        case Kind::weighted:
            break;
    }
    return {part.channels, height, width};
}

/// upsample(I, 2, 0) of docs/pipelines.md, "Operators", at one place of an axis: two pixels and the second one's
/// weight.
struct Tap {
    int first, second;
    float weight;
};
Tap tap(int x, int size) {
    const float coordinate = (x + 0.5f) / 2 - 0.5f;
    const int whole = static_cast<int>(std::floor(coordinate));
    return {std::clamp(whole, 0, size - 1), std::clamp(whole + 1, 0, size - 1), coordinate - whole};
}

/// Channel c of a part at pixel (x, y) of the input.
float read(const Case& test, const Part& part, const Planes& image, const Planes& factor, int c, int x, int y) {
    const int inner_x = std::min(x, test.input.width - test.margin.width - 1);
    const int inner_y = std::min(y, test.input.height - test.margin.height - 1);
    switch (part.kind) {
        case Kind::whole:
            return image.at(c, inner_x, inner_y);
        case Kind::weighted:
            return image.at(c, inner_x, inner_y) * factor.at(0, inner_x, inner_y);
        case Kind::pooled:
            return std::max({image.at(c, 2 * x, 2 * y), image.at(c, 2 * x + 1, 2 * y), image.at(c, 2 * x, 2 * y + 1),
                             image.at(c, 2 * x + 1, 2 * y + 1)});
        case Kind::upsampled: {
            const Tap tx = tap(x, image.shape.width), ty = tap(y, image.shape.height);
            const auto row = [&](int at) {
                return std::lerp(image.at(c, tx.first, at), image.at(c, tx.second, at), tx.weight);
            };
            return std::lerp(row(ty.first), row(ty.second), ty.weight);
        }
        case Kind::samples:
            break;
    }
    const bool is_sample = inner_x % test.scale == test.sample.x && inner_y % test.scale == test.sample.y;
    return is_sample ? image.at(c, inner_x / test.scale, inner_y / test.scale) : 0;
}

runtime::TensorLayout layout_of(const graph::Shape& shape, Storage storage, bool of_larger) {
    return of_larger ? part_layout(shape, storage, 1, shape.channels + 8, 4) : pixel_layout(shape, storage);
}

void check_input(const Case& test, bool all_choices = false) {
    CAPTURE(test.input.width);
    CAPTURE(test.input.height);
    CAPTURE(test.scale);
    std::mt19937 random(11);
    graph::Convolution convolution{0, graph::Activation::relu, {}, test.input.width, test.input.height};
    runtime::Problem problem;
    std::vector<Planes> images;
    Planes input{{0, test.input.height, test.input.width}, {}};
    for (const Part& part : test.parts) {
        const graph::Shape shape = stored_shape(test, part);
        const Planes image = rounded(random_planes(shape, random, -1, 1), test.storage);
        images.push_back(image);
        problem.inputs.push_back(layout_of(shape, test.storage, part.of_larger));
        convolution.readings.push_back(part.kind == Kind::pooled      ? Reading::pooled
                                       : part.kind == Kind::upsampled ? Reading::upsampled
                                                                      : Reading::whole);
        if (part.kind == Kind::samples) {
            runtime::TensorLayout& layout = problem.inputs.back();
            layout.samples = test.scale;
            layout.width *= test.scale;
            layout.height *= test.scale;
        }
        Planes factor;
        if (part.kind == Kind::weighted) {
            const graph::Shape one{1, shape.height, shape.width};
            factor = rounded(random_planes(one, random, 0, 2), test.storage);
            images.push_back(factor);
            problem.inputs.push_back(layout_of(one, test.storage, true));
            convolution.readings.push_back(Reading::factor);
        }
        const Planes values = planes({part.channels, test.input.height, test.input.width},
                                     [&](int c, int x, int y) { return read(test, part, image, factor, c, x, y); });
        input.values.insert(input.values.end(), values.values.begin(), values.values.end());
        input.shape.channels += part.channels;
    }
    const graph::Parameters parameters =
        random_parameters(test.out_channels, input.shape.channels, test.kernel, 1, random);
    const graph::Shape out{test.out_channels, test.input.height, test.input.width};
    problem.node = {convolution, {}, out, "convolution"};
    problem.output = pixel_layout(out, test.storage);
    problem.parameters = &parameters;
    runtime::FrameConstants frame;
    frame.sample_x = test.sample.x;
    frame.sample_y = test.sample.y;
    const Planes expected = expected_convolution(input, parameters, 0, convolution.activation, test.input);
    check_together([&] {
        visit_implementations(problem, all_choices, [&](const auto& implementation, const auto& choices) {
            const float tolerance =
                std::max(convolution_tolerance(implementation, choices), storage_tolerance(test.storage));
            check_result(problem, implementation, choices, images, frame, 0,
                         [=](const Planes& result) { check_close(result, expected, tolerance); });
        });
    });
}

}  // namespace

TEST_CASE("convolutions of weighted maps and samples, as NSRR's U-Net begins") {
    const std::vector<Part> parts{{Kind::weighted, 12}, {Kind::weighted, 12}, {Kind::samples, 12}};
    check_input({{40, 24}, parts, 64});
    check_input({{40, 24}, parts, 32, Storage::f16});
    for (const int scale : {2, 3, 5, 6})
        for (const int place : {0, scale - 1})
            check_input(
                {{61, 31}, parts, 20, Storage::f32, scale, {61 % scale, 31 % scale}, 3, {place, scale - 1 - place}});
}

TEST_CASE("convolutions of parts of maps and samples, as NSRR's reweighting begins") {
    const std::vector<Part> parts{
        {Kind::whole, 4, true}, {Kind::whole, 4, true}, {Kind::whole, 4, true}, {Kind::samples, 4, true}};
    check_input({{72, 20}, parts, 32});
    check_input({{72, 20}, parts, 3, Storage::f16});
    check_input({{72, 20}, parts, 18, Storage::f32, 2, {0, 0}, 5});
}

TEST_CASE("convolutions of pooled and of upsampled images") {
    check_input({{37, 21}, {{Kind::pooled, 32}}, 64});
    check_input({{38, 11}, {{Kind::pooled, 12}, {Kind::pooled, 5}}, 20, Storage::f16});
    check_input({{74, 22}, {{Kind::upsampled, 32}, {Kind::whole, 16}}, 32});
    check_input({{74, 22}, {{Kind::upsampled, 24}, {Kind::whole, 7, true}}, 3, Storage::f16});
    check_input({{74, 22}, {{Kind::upsampled, 20}}, 16, Storage::f32, 4, {0, 0}, 5});
    check_input({{2, 2}, {{Kind::upsampled, 16}}, 16});
}

TEST_CASE("every choice reads its input alike") {
    check_input({{72, 20}, {{Kind::weighted, 12}, {Kind::upsampled, 16}, {Kind::samples, 4}}, 36}, true);
}

TEST_CASE("as many images as a convolution's input may be made of") {
    std::vector<Part> parts(7, {Kind::whole, 4});
    parts.push_back({Kind::samples, 3});
    check_input({{24, 12}, parts, 16});
}

TEST_SUITE("small") {
    TEST_CASE("convolutions of small images put together") {
        check_input({{1, 1}, {{Kind::weighted, 4}, {Kind::pooled, 3}}, 5});
        check_input({{8, 5}, {{Kind::weighted, 4}, {Kind::samples, 3}}, 16, Storage::f32, 3, {2, 2}, 3, {2, 2}});
        check_input({{10, 6}, {{Kind::upsampled, 16}, {Kind::whole, 2}}, 4});
        check_input({{10, 6}, {{Kind::samples, 13}}, 4, Storage::f32, 2, {0, 0}, 3, {1, 0}});
    }
}
