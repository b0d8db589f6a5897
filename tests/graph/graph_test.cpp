#include "graph/graph.h"

#include <doctest/doctest.h>

#include <stdexcept>

#include "graph/passes.h"
#include "zero_parameters.h"

using namespace clarus;
using namespace clarus::graph;

namespace {

int count(const Graph& graph, bool (*matches)(const Node&)) {
    int matching = 0;
    for (const Node& node : graph.nodes) matching += matches(node);
    return matching;
}

bool is_pointwise(const Node& node) { return std::holds_alternative<Pointwise>(node.op); }
bool is_concat(const Node& node) { return std::holds_alternative<Concat>(node.op); }

}  // namespace

TEST_SUITE("small") {
    TEST_CASE("shapes follow from operators") {
        Graph graph;
        const Value color = graph.input(Resource::color, {7, 5});
        const Value depth = graph.input(Resource::depth, {7, 5});
        const Value motion = graph.input(Resource::motion, {7, 5});
        CHECK(graph.shape(graph.upsample(color, 3, Shift::jitter, "up")) == Shape{3, 15, 21});
        CHECK(graph.shape(graph.dilate(motion, depth, 3)) == Shape{2, 2, 3});
        CHECK(graph.shape(graph.concat({color, depth})) == Shape{4, 5, 7});
        const Value image = graph.previous({4, 10, 14}, "image");
        CHECK(graph.shape(graph.space_to_depth(image, 2)) == Shape{16, 5, 7});
        CHECK(graph.shape(graph.depth_to_space(graph.space_to_depth(image, 2), 2)) == Shape{4, 10, 14});
        CHECK(graph.shape(graph.convolution(color, zero_parameters(8, 3), Activation::relu, "c")) == Shape{8, 5, 7});
        CHECK_THROWS_AS(graph.convolution(color, zero_parameters(8, 4), Activation::relu, "c"), std::logic_error);
        CHECK_THROWS_AS(graph.space_to_depth(color, 2), std::logic_error);
        CHECK_THROWS_AS(graph.slice(color, 2, 2), std::logic_error);
    }

    TEST_CASE("operations are those of the plain definition") {
        Graph graph;
        const Value color = graph.input(Resource::color, {7, 5});
        const Value features = graph.convolution(color, zero_parameters(8, 3), Activation::relu, "c");
        CHECK(operations(graph, graph.nodes[features]) == 2.0 * 9 * 3 * 8 * 35);
    }

    TEST_CASE("pointwise chains become one program, also through concat") {
        Graph graph;
        const Value a = graph.previous({3, 4, 6}, "a");
        const Value b = graph.previous({3, 4, 6}, "b");
        const Value weight = graph.previous({1, 4, 6}, "weight");
        const Value state = graph.previous({4, 4, 6}, "state");
        const Value alpha = graph.sigmoid(weight, "alpha");
        graph.output = graph.clamp(graph.mix(a, b, alpha, "mix"), 0, 1, "clamp");
        graph.carry(state, graph.concat({graph.output, weight}));
        graph.views = {{"alpha", alpha}};
        // The states of the other inputs, so that nothing is unused.
        graph.carry(a, graph.slice(state, 0, 3));
        graph.carry(b, graph.slice(state, 1, 3));
        graph.carry(weight, graph.slice(state, 3, 1));

        SUBCASE("all of it where nobody looks inside") {
            const Graph fused = fuse_pointwise(remove_unused(graph, {}));
            CHECK(count(fused, is_pointwise) == 1);
            CHECK(count(fused, is_concat) == 0);
            const Node& output = fused.nodes[fused.output];
            REQUIRE(std::holds_alternative<Slice>(output.op));
            CHECK(std::get<Slice>(output.op).first == 0);
            CHECK(output.shape == Shape{3, 4, 6});
            const Node& program = fused.nodes[output.inputs[0]];
            CHECK(program.shape == Shape{4, 4, 6});
            CHECK(std::get<Pointwise>(program.op).steps.size() == 3);
            CHECK(std::get<Pointwise>(program.op).results.size() == 2);
        }
        SUBCASE("but what is looked at stays a value of its own") {
            const Graph fused = fuse_pointwise(remove_unused(graph, {"alpha"}));
            CHECK(count(fused, is_pointwise) == 2);
            CHECK(fused.nodes[fused.views.at("alpha")].name == "alpha");
        }
    }

    TEST_CASE("a chain of a thousand steps becomes several programs") {
        Graph graph;
        Value value = graph.previous({3, 4, 6}, "a");
        for (int i = 0; i < 1000; ++i) value = graph.tanh(value, "tanh");
        graph.output = value;
        const Graph fused = fuse(graph, {});
        size_t steps = 0, programs = 0;
        for (const Node& node : fused.nodes)
            if (const auto* program = std::get_if<Pointwise>(&node.op)) {
                CHECK(program->steps.size() <= 32);
                steps += program->steps.size();
                ++programs;
            }
        CHECK(steps == 1000);
        CHECK(programs >= 32);
        CHECK(programs <= 64);
    }

    TEST_CASE("a chain on many channels becomes several programs sooner") {
        Graph graph;
        Value value = graph.previous({512, 4, 6}, "a");
        for (int i = 0; i < 12; ++i) value = graph.tanh(value, "tanh");
        graph.output = value;
        const Graph fused = fuse(graph, {});
        CHECK(count(fused, is_pointwise) == 3);  // 2048 statements each
    }

    TEST_CASE("a value that several parts of one program use is a part of it, too") {
        Graph graph;
        const Value color = graph.input(Resource::color, {6, 4});
        const Value seen = graph.clamp(color, 0.25f, 0.75f, "seen");
        graph.output = graph.product(graph.sum(seen, color, "sum"), graph.difference(seen, color, "difference"), "all");
        const Graph fused = fuse_pointwise(graph);
        REQUIRE(count(fused, is_pointwise) == 1);
        const Node& program = fused.nodes[fused.output];
        CHECK(program.inputs.size() == 1);
        CHECK(std::get<Pointwise>(program.op).steps.size() == 4);
    }

    TEST_CASE("what nothing needs is dropped, what a state needs is kept") {
        Graph graph;
        const Value color = graph.input(Resource::color, {4, 4});
        const Value history = graph.previous({3, 4, 4}, "history");
        const Value half = graph.previous({1, 4, 4}, "half");
        graph.input(Resource::depth, {4, 4});
        graph.output = graph.mix(color, history, half, "mix");
        const Value next = graph.clamp(color, 0, 0.5f, "next");
        graph.carry(history, next);
        graph.carry(half, graph.slice(next, 0, 1));
        const Graph kept = remove_unused(graph, {});
        CHECK(kept.nodes.size() == graph.nodes.size() - 1);
        CHECK(kept.states.size() == 2);
        for (const State& state : kept.states) CHECK(std::holds_alternative<Previous>(kept.nodes[state.previous].op));
    }

    TEST_CASE("a convolution reads an image in blocks apart from what is before it") {
        Graph graph;
        const Value color = graph.input(Resource::color, {6, 4}), depth = graph.input(Resource::depth, {6, 4});
        const Value history = graph.previous({2, 8, 12}, "history");
        const Value warped = graph.clamp(history, 0, 1, "warped"), blocks = graph.space_to_depth(warped, 2);
        Parameters first{3, 12, 2, true};
        for (int i = 0; i < 2 * 3 * 12 * 9; ++i)
            first.weights.push_back(static_cast<float>(i / 9));  // channel by channel
        first.biases.resize(6);
        DenseLayer predictor{3 * 12 * 9 + 3, 1, {}, {}};
        for (int i = 0; i < 3 * 12 * 9; ++i) predictor.weights.push_back(static_cast<float>(i / 9));
        predictor.weights.resize(predictor.out);
        predictor.biases = predictor.weights;
        const auto convolved = [&](Value joined) {
            graph.output = graph.convolution(joined, first, Activation::relu, "first");
            graph.carry(history, warped);
            graph.jitter_kernels = JitterKernels{{{0, 0}, {0.25f, 0}}, {predictor}, {0}};
            return fuse_convolution_inputs(graph);
        };
        SUBCASE("whose weights are the first then, wherever they come from") {
            const Graph fused = convolved(graph.concat({color, depth, blocks}));
            const Node& node = fused.nodes[fused.output];
            const auto& convolution = std::get<Convolution>(node.op);
            REQUIRE(node.inputs.size() == 2);
            CHECK(convolution.readings == std::vector{Reading::whole, Reading::whole});
            CHECK(Size{convolution.width, convolution.height} == Size{6, 4});
            CHECK(std::holds_alternative<SpaceToDepth>(fused.nodes[node.inputs[0]].op));
            CHECK(fused.shape(node.inputs[1]) == Shape{4, 4, 6});
            const std::vector<DenseLayer>& layers = fused.jitter_kernels->predictor;
            for (int row = 0; row < 6; ++row)
                for (int channel = 0; channel < 12; ++channel) {
                    const float weight = static_cast<float>(12 * row + (channel + 4) % 12);
                    CHECK(fused.parameters[0]->weights[9 * (12 * row + channel)] == weight);
                    if (row >= 3) continue;
                    CHECK(layers[0].weights[9 * (12 * row + channel)] == weight);
                    CHECK(layers[0].biases[9 * (12 * row + channel) + 8] == weight);
                }
        }
        SUBCASE("but not where it comes before") {
            const Graph fused = convolved(graph.concat({blocks, color, depth}));
            CHECK(std::get<Convolution>(fused.nodes[fused.output].op).readings.empty());
        }
    }

    TEST_CASE("convolutions take in what they read") {
        Graph graph;
        const Value color = graph.input(Resource::color, {8, 6});
        const auto layer = [&](Value image, int channels, const char* name) {
            return graph.convolution(image, zero_parameters(channels, graph.shape(image).channels), Activation::relu,
                                     name);
        };
        const Value features = layer(color, 4, "features");
        const Value large = layer(graph.upsample(color, 2, Shift::jitter, "large"), 4, "maps");
        const Value weights = layer(large, 1, "weights");

        SUBCASE("weighted maps, made larger, and samples, whose weights become the last") {
            const Value samples = graph.zero_upsample(features, 2);
            std::vector<Value> maps{samples, graph.product(large, weights, "weighting")};
            for (Value& map : maps) map = graph.replicate_to(map, {20, 12});
            Parameters all{1, 8};
            for (int i = 0; i < 72; ++i) all.weights.push_back(i);
            all.biases = {0};
            graph.output = graph.convolution(graph.concat(maps), all, Activation::none, "first");
            const Graph fused = fuse_convolution_inputs(graph);
            const Node& first = fused.nodes[fused.output];
            const auto& convolution = std::get<Convolution>(first.op);
            CHECK(convolution.readings == std::vector{Reading::whole, Reading::factor, Reading::whole});
            CHECK(Size{convolution.width, convolution.height} == Size{20, 12});
            CHECK(fused.nodes[first.inputs[0]].name == "maps");
            CHECK(fused.nodes[first.inputs[1]].name == "weights");
            CHECK(std::holds_alternative<ZeroUpsample>(fused.nodes[first.inputs[2]].op));
            CHECK(fused.parameters[convolution.parameters]->weights.front() == 36);
            CHECK(fused.parameters[convolution.parameters]->weights.back() == 35);
            CHECK(count(fused, is_concat) == 0);
            CHECK(count(fused, is_pointwise) == 0);
        }
        SUBCASE("pooled and upsampled images") {
            const Value half = layer(graph.max_pool(large, "pool"), 4, "half");
            graph.output = layer(graph.concat({graph.upsample(half, 2, Shift::none, "up"), large}), 3, "last");
            const Graph fused = fuse_convolution_inputs(graph);
            const Node& last = fused.nodes[fused.output];
            CHECK(std::get<Convolution>(last.op).readings == std::vector{Reading::upsampled, Reading::whole});
            const Node& pooling = fused.nodes[last.inputs[0]];
            CHECK(pooling.name == "half");
            CHECK(std::get<Convolution>(pooling.op).readings == std::vector{Reading::pooled});
            CHECK(pooling.inputs == std::vector{last.inputs[1]});
        }
        SUBCASE("but not what is used or seen elsewhere, nor what the kernels could not read") {
            const Value pool = graph.max_pool(large, "pool");
            graph.views = {{"pool", pool}};
            const Value odd = layer(graph.upsample(layer(pool, 3, "odd"), 2, Shift::none, "up"), 3, "whole");
            const Value parts = graph.concat({graph.upsample(layer(pool, 3, "three"), 2, Shift::none, "up"), odd});
            graph.output = layer(parts, 3, "last");
            const Graph fused = fuse_convolution_inputs(graph);
            int readings = 0;
            for (const Node& node : fused.nodes)
                if (const auto* convolution = std::get_if<Convolution>(&node.op); convolution && node.name != "whole")
                    readings += static_cast<int>(convolution->readings.size());
            CHECK(readings == 0);
            CHECK(fused.views.contains("pool"));
        }
        SUBCASE("nor where weights or storage are others") {
            Parameters weighted = zero_parameters(4, 4);
            Value image = large;
            SUBCASE("weights of the frame's jitter") { weighted.conditioned = true; }
            SUBCASE("groups") {
                weighted.groups = 2;
                weighted.weights.resize(weighted.weights_per_set());
            }
            SUBCASE("a stride") { weighted.stride = 2; }
            SUBCASE("a value of the frame before") {
                image = graph.previous(graph.shape(large), "before");
                graph.carry(image, large);
            }
            SUBCASE("depth, which is not stored as images are") {
                image = graph.input(Resource::depth, {16, 12});
                weighted = zero_parameters(4, 1);
            }
            SUBCASE("zeros that are not stored") { image = graph.zero_upsample(features, 2); }
            graph.output = graph.convolution(graph.max_pool(image, "pool"), weighted, Activation::relu, "layer");
            const Graph fused = fuse_convolution_inputs(graph);
            CHECK(std::get<Convolution>(fused.nodes[fused.output].op).readings.empty());
        }
        SUBCASE("nor two zero-upsampled images, nor more images than they count") {
            std::vector<Value> images;
            SUBCASE("two") { images.assign(2, graph.zero_upsample(features, 2)); }
            SUBCASE("nine") {
                images.assign(8, large);
                images.push_back(graph.product(large, weights, "weighting"));
            }
            graph.output = layer(graph.concat(images), 3, "layer");
            const Graph fused = fuse_convolution_inputs(graph);
            CHECK(std::get<Convolution>(fused.nodes[fused.output].op).readings.empty());
        }
    }
}
