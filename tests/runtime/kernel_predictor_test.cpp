#include "runtime/kernel_predictor.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "test_device.h"

using namespace clarus;
using namespace clarus::runtime;

namespace {

std::vector<graph::DenseLayer> random_layers(const std::vector<int>& widths) {
    std::mt19937 random(17);
    std::uniform_real_distribution<float> any(-1, 1);
    std::vector<graph::DenseLayer> layers;
    for (size_t i = 1; i < widths.size(); ++i) {
        graph::DenseLayer& layer = layers.emplace_back(graph::DenseLayer{widths[i], widths[i - 1], {}, {}});
        layer.weights.resize(static_cast<size_t>(layer.out) * layer.in);
        layer.biases.resize(layer.out);
        for (float& value : layer.weights) value = any(random);
        for (float& value : layer.biases) value = any(random);
    }
    return layers;
}

std::vector<double> expected(const std::vector<graph::DenseLayer>& layers, Vec2 jitter) {
    std::vector<double> values{jitter.x, jitter.y};
    for (size_t i = 0; i < layers.size(); ++i) {
        const graph::DenseLayer& layer = layers[i];
        std::vector<double> next(layer.biases.begin(), layer.biases.end());
        for (int out = 0; out < layer.out; ++out) {
            for (int in = 0; in < layer.in; ++in)
                next[out] += double(layer.weights[static_cast<size_t>(out) * layer.in + in]) * values[in];
            if (i + 1 < layers.size()) next[out] = std::max(next[out], 0.0);
        }
        values = next;
    }
    return values;
}

}  // namespace

TEST_CASE("the predictor computes its layers, ReLU after all but the last, for one jitter after another") {
    // One layer has more outputs than a work-group of ReLU has items.
    for (const std::vector<int>& widths : {std::vector<int>{2, 7, 67, 5}, {2, 3}}) {
        CAPTURE(widths.size());
        const std::vector<graph::DenseLayer> layers = random_layers(widths);
        ocl::Context& context = test_device().context();
        KernelPredictor predictor(context, layers);
        bool negative = false;
        for (const Vec2 jitter : {Vec2{0.25f, -0.375f}, Vec2{-0.5f, 0.125f}, Vec2{0, 0}}) {
            const std::vector<double> should = expected(layers, jitter);
            std::vector<float> is(should.size());
            context.queue().enqueueReadBuffer(predictor.predict(jitter), CL_TRUE, 0, is.size() * sizeof(float),
                                              is.data());
            for (size_t i = 0; i < is.size(); ++i) {
                CHECK(std::abs(is[i] - should[i]) < 1e-5 * std::max(1.0, std::abs(should[i])));
                negative = negative || is[i] < 0;
            }
        }
        CHECK(negative);  // else a ReLU after the last layer would not be seen
    }
}

TEST_CASE("the predictor's memory is its jitter, weights, biases and results") {
    CHECK(KernelPredictor::bytes(random_layers({2, 7, 5})) == sizeof(float) * (2 + (14 + 7 + 7) + (35 + 5 + 5)));
}
