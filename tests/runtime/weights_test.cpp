#include "runtime/weights.h"

#include <doctest/doctest.h>

#include <cmath>
#include <utility>

#include "convolution_harness.h"
#include "runtime/plan.h"
#include "test_device.h"

using namespace clarus;
using namespace clarus::runtime;

namespace {

/// A network of one conditioned convolution and one that is not.
struct Network {
    explicit Network(const graph::Parameters& conditioned, std::vector<Vec2> table = {},
                     std::vector<graph::DenseLayer> predictor = {}) {
        graph::Graph graph;
        const graph::Value color = graph.input(graph::Resource::color, {9, 7});
        std::mt19937 random(3);
        graph.output = graph.convolution(graph.convolution(color, conditioned, graph::Activation::relu, "conditioned"),
                                         test::random_parameters(3, conditioned.out_channels, 3, 1, random),
                                         graph::Activation::none, "other");
        if (conditioned.conditioned) graph.jitter_kernels = {std::move(table), std::move(predictor), {0}};
        const DeviceProfile profile = test_device().profile();
        plan = make_plan(graph, options, profile,
                         [&](const Problem& problem) { return obvious_selection(problem, profile); });
        std::vector<const KernelCall*> calls;
        for (const PlannedStage& stage : plan->stages) {
            calls.push_back(&stage.lowered.call);
            if (stage.lowered.packing) calls.push_back(&stage.lowered.packing->call);
        }
        kernels.emplace(test_device().context(), calls);
        weights.emplace(test_device().context(), *kernels, plan->layout.graph, plan->convolutions());
    }

    /// The current set of a convolution's packed weights.
    std::vector<float> current(int parameters) const {
        std::vector<float> values(plan->convolutions().at(parameters).packing->floats);
        test_device().context().queue().enqueueReadBuffer(weights->packed(parameters), CL_TRUE,
                                                          weights->offset(parameters) * sizeof(float),
                                                          values.size() * sizeof(float), values.data());
        return values;
    }

    size_t device_bytes() const {
        size_t bytes = 0;
        for (const auto& [index, lowered] : plan->convolutions())
            bytes += weights->packed(index).getInfo<CL_MEM_SIZE>();
        return bytes;
    }

    runtime::PlanOptions options;
    std::unique_ptr<Plan> plan;
    std::optional<Kernels> kernels;
    std::optional<Weights> weights;
};

constexpr int kSets = 3;
const std::vector<Vec2> kTable{{0, 0}, {0.25f, -0.25f}, {-0.375f, 0.125f}};

graph::Parameters conditioned() {
    std::mt19937 random(5);
    graph::Parameters parameters = test::random_parameters(4, 3, 3, kSets, random);
    parameters.conditioned = true;
    return parameters;
}

/// One set of the parameters, as a convolution of its own.
graph::Parameters only(const graph::Parameters& all, int set) {
    graph::Parameters parameters{all.out_channels, all.in_channels};
    const size_t weights = all.weights_per_set(), biases = all.out_channels;
    parameters.weights.assign(all.weights.begin() + set * weights, all.weights.begin() + (set + 1) * weights);
    parameters.biases.assign(all.biases.begin() + set * biases, all.biases.begin() + (set + 1) * biases);
    return parameters;
}

}  // namespace

TEST_CASE("the frame's jitter chooses the set of a conditioned convolution, and of no other") {
    const graph::Parameters all = conditioned();
    Network network(all, kTable);
    const std::vector<float> other = network.current(1);
    for (int set = 0; set < kSets; ++set) {
        CAPTURE(set);
        network.weights->select(kTable[set]);
        CHECK(network.current(0) == Network(only(all, set)).current(0));
        CHECK(network.weights->offset(1) == 0);
        CHECK(network.current(1) == other);
    }
    CHECK(network.weights->largest_jitter_distance() == 0);
    network.weights->select({0.25f, 0});
    CHECK(network.weights->largest_jitter_distance() == doctest::Approx(0.25));
}

TEST_CASE("a jitter beside the table has a set that the predictor computes") {
    const graph::Parameters all = conditioned();
    const size_t floats = all.weights_per_set() + all.out_channels;
    // What it predicts does not depend on the jitter: set 2 of the table.
    const graph::Parameters predicted = only(all, 2);
    graph::DenseLayer layer{static_cast<int>(floats), 2, std::vector<float>(2 * floats), predicted.weights};
    layer.biases.insert(layer.biases.end(), predicted.biases.begin(), predicted.biases.end());
    Network network(all, kTable, {layer});
    network.weights->select({0.4f, 0.4f});
    CHECK(network.weights->offset(0) > 2 * network.plan->convolutions().at(0).packing->floats);
    CHECK(network.current(0) == Network(predicted).current(0));
    CHECK(network.weights->largest_jitter_distance() == 0);
    network.weights->select(kTable[1]);
    CHECK(network.current(0) == Network(only(all, 1)).current(0));
}

TEST_CASE("weights take the memory that was said") {
    for (const Network& network : {Network(only(conditioned(), 0)), Network(conditioned(), kTable)})
        CHECK(Weights::bytes(network.plan->layout.graph, network.plan->convolutions()) == network.device_bytes());
}
