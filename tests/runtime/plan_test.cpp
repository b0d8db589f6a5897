#include "runtime/plan.h"

#include <doctest/doctest.h>

#include <map>
#include <stdexcept>

#include "api/build_graph.h"
#include "clarus/error.h"
#include "runtime/bands.h"
#include "runtime/jitter_sets.h"
#include "runtime/short_launches.h"
#include "zero_parameters.h"

using namespace clarus;
using namespace clarus::graph;
using namespace clarus::runtime;

namespace {

/// Where element (c, y, x) of a value lies in its memory, straight from the definition of cells.
size_t element(const TensorLayout& layout, int c, int y, int x) {
    const int s = layout.block;
    return static_cast<size_t>(y / s) * layout.row() + static_cast<size_t>(x / s) * layout.stride + layout.offset +
           c * s * s + y % s * s + x % s;
}

}  // namespace

TEST_SUITE("small") {
    TEST_CASE("concat and space-to-depth are views of one memory") {
        Graph graph;
        const Value color = graph.input(Resource::color, {5, 3});
        const Value history = graph.previous({2, 6, 10}, "history");
        const Value image = graph.clamp(history, 0, 1, "image");
        const Value depth = graph.space_to_depth(image, 2);
        const Value joined = graph.concat({color, depth});
        graph.output = graph.convolution(joined, zero_parameters(3, 11), Activation::none, "c");
        graph.carry(history, image);
        const LayoutPlan plan = lay_out(graph, Storage::f32);
        REQUIRE(plan.graph.nodes.size() == graph.nodes.size());
        CHECK(plan.layouts[color].memory == plan.layouts[joined].memory);
        CHECK(plan.layouts[image].memory == plan.layouts[joined].memory);
        CHECK(plan.layouts[joined].stride == 12);  // eleven channels, rounded up to four
        for (int c = 0; c < 2; ++c)
            for (int y = 0; y < 6; ++y)
                for (int x = 0; x < 10; ++x)
                    CHECK(element(plan.layouts[image], c, y, x) ==
                          element(plan.layouts[joined], 3 + 4 * c + 2 * (y % 2) + x % 2, y / 2, x / 2));
    }

    TEST_CASE("previous depth is written where it was filled, and stays float as motion does") {
        Graph graph;
        const Value depth = graph.input(Resource::depth, {5, 3}), motion = graph.input(Resource::motion, {5, 3});
        const Value previous = graph.previous_depth(motion, depth);
        const Value checked = graph.checked_motion(motion, depth, previous);
        const Value moved = graph.reproject(checked, depth, 1.5, {8, 5});
        const Value valid = graph.validity(checked);
        graph.output = graph.concat({valid, valid, valid});
        graph.views["motion"] = moved;
        const LayoutPlan plan = lay_out(graph, Storage::f16);
        const auto find = [&](const char* name) {
            for (Value value = 0; value < static_cast<Value>(plan.graph.nodes.size()); ++value)
                if (plan.graph.nodes[value].name == name) return plan.layouts[value];
            return TensorLayout();
        };
        CHECK(find("previous depth") == find("previous depth: fill"));
        for (const char* name : {"previous depth", "checked motion", "reproject"})
            CHECK(find(name).storage == Storage::f32);
        CHECK(find("validity").storage == Storage::f16);
    }

    TEST_CASE("what cannot be written in place is copied") {
        Graph graph;
        const Value color = graph.input(Resource::color, {4, 4});
        const Value twice = graph.concat({color, graph.slice(color, 0, 1), color});
        graph.output = graph.convolution(twice, zero_parameters(3, 7), Activation::none, "c");
        const LayoutPlan plan = lay_out(graph, Storage::f32);
        CHECK(plan.graph.nodes.size() == graph.nodes.size() + 2);
        const Node& joined = plan.graph.nodes[plan.graph.nodes[plan.graph.output].inputs[0]];
        int offset = 0;
        for (const Value part : joined.inputs) {
            CHECK(plan.layouts[part].offset == offset);
            offset += plan.graph.shape(part).channels;
        }
    }

    TEST_CASE("a history of samples is copied into cells, not kept in them") {
        Graph graph;
        const Value color = graph.input(Resource::color, {4, 4}), depth = graph.input(Resource::depth, {4, 4});
        const Value motion = graph.input(Resource::motion, {4, 4});
        const Value history = graph.previous({4, 8, 8}, "history");
        const Value moved = graph.reproject(motion, depth, 2, {8, 8});
        const Value past = graph.warp_sharply(history, moved, color, 2);
        const Value trust = graph.trust(graph.residual(color, past), motion, 2);
        const Value collected = graph.collect(color, past, trust, moved, 2);
        graph.carry(history, collected);
        const Value joined = graph.concat({color, graph.space_to_depth(collected, 2)});
        graph.output = graph.convolution(joined, zero_parameters(3, 19), Activation::none, "c");
        const LayoutPlan plan = lay_out(graph, Storage::f32);
        CHECK(plan.graph.nodes.size() == graph.nodes.size() + 1);
        for (const Value value : {history, collected}) {
            CHECK(plan.layouts[value].block == 1);
            CHECK(plan.layouts[value].stride == 4);
        }
    }

    TEST_CASE("depth and motion vectors stay in float where images are half") {
        Graph graph;
        const Value color = graph.input(Resource::color, {8, 8});
        const Value depth = graph.input(Resource::depth, {8, 8});
        const Value motion = graph.input(Resource::motion, {8, 8});
        const Value block_motion = graph.dilate(motion, depth, 2);
        const Value history = graph.previous({3, 16, 16}, "history");
        const Value warped = graph.warp(history, block_motion, kDilationBlock, Border::clamp, color, 2);
        graph.carry(history, warped);
        graph.output = warped;
        const LayoutPlan plan = lay_out(graph, Storage::f16);
        CHECK(plan.layouts[warped].storage == Storage::f16);
        CHECK(plan.layouts[color].storage == Storage::f16);
        for (const Value value : {depth, motion, block_motion}) CHECK(plan.layouts[value].storage == Storage::f32);
    }

    TEST_CASE("what is read once the frame is over is stored whole") {
        Graph graph;
        const Value color = graph.input(Resource::color, {4, 4});
        const Value samples = graph.zero_upsample(color, 2);
        graph.output = graph.clamp(samples, 0, 1, "output");
        CHECK_NOTHROW(lay_out(graph, Storage::f32));
        graph.views["samples"] = graph.slice(samples, 0, 1);
        CHECK_THROWS_AS(lay_out(graph, Storage::f32), std::logic_error);
        graph.views.clear();
        graph.output = samples;
        CHECK_THROWS_AS(lay_out(graph, Storage::f32), std::logic_error);
    }

    TEST_CASE("of an image with more elements than a kernel can count, a ring of rows may do") {
        Graph graph;
        const Value color = graph.input(Resource::color, {7680, 4320});
        const Value features = graph.convolution(color, zero_parameters(96, 3), Activation::relu, "c");
        graph.output = graph.convolution(features, zero_parameters(3, 96), Activation::none, "c");
        LayoutPlan plan = lay_out(graph, Storage::f32);
        CHECK_THROWS_WITH_AS(check_sizes(plan), doctest::Contains("96 channels of 7680x4320 pixels"), Error);
        CHECK(plan_bands(plan, 0, {}).banded.size() == 1);
        CHECK_NOTHROW(check_sizes(plan));
    }

    TEST_CASE("a kernel whose work-groups bands would cut is refused, with its operator's name") {
        Graph graph;
        graph.output = graph.clamp(graph.input(Resource::color, {8, 64}), 0, 1, "the limits");
        PlanOptions options;
        DeviceProfile profile;
        profile.memory_alignment = 128;
        const auto plan = [&](size_t group_rows, size_t items) {
            const auto always = [](const Problem&, const DeviceProfile&) { return 1; };
            const Implementation implementation{"tall", always, {}, [&](const Problem& problem, const Choices&) {
                                                    KernelCall call;
                                                    call.global = {static_cast<size_t>(problem.output.width), items};
                                                    call.local = {1, group_rows};
                                                    return Lowered{call, std::nullopt};
                                                }};
            make_plan(graph, options, profile, [&](const Problem&) { return Selection{&implementation, {}}; });
        };
        CHECK_NOTHROW(plan(16, 64));
        options.band_rows = 8;
        CHECK_NOTHROW(plan(8, 64));
        CHECK_THROWS_WITH_AS(plan(16, 64), doctest::Contains("the limits by tall"), std::logic_error);
        CHECK_THROWS_WITH_AS(plan(8, 32), doctest::Contains("the limits by tall"), std::logic_error);
    }

    TEST_CASE("at 8K no launch of a GPU is long, and all rows are made once") {
        DeviceProfile profile;
        profile.memory_alignment = 128;
        profile.compute_units = 24;
        profile.clock_mhz = 1000;
        profile.local_memory = 1 << 16;
        profile.max_work_group_size = 256;
        const auto select = [&](const Problem& problem) { return built_in_selection(problem, profile); };
        for (const char* name : {"clarus-m", "enss-m-x2", "nsrr-x2", "mnss-x2", "fsr2"}) {
            CAPTURE(name);
            const graph::Graph graph = build_graph(Model::find(name, 2), {3840, 2160}, {7680, 4320}, {});
            for (const DeviceClass device_class : {DeviceClass::cpu, DeviceClass::gpu}) {
                profile.device_class = device_class;
                const auto plan = make_plan(graph, {}, profile, select);
                std::map<int, std::vector<Rows>> made;
                double longest = 0;
                for (const StageRows& launch : plan->launches) {
                    const PlannedStage& stage = plan->stages[launch.stage];
                    const Rows all = rows_of(stage.lowered.call);
                    const Rows rows = launch.end == 0 ? all : Rows{launch.first, launch.end};
                    made[launch.stage].push_back(rows);
                    longest = std::max(longest, most_seconds(stage.problem, profile) * (rows.end - rows.first) /
                                                    (all.end - all.first));
                }
                CHECK((longest <= kLongestLaunch) == (device_class == DeviceClass::gpu));
                CHECK(made.size() == plan->stages.size());
                for (const auto& [stage, pieces] : made) {
                    CHECK(pieces.front().first == 0);
                    for (size_t piece = 1; piece < pieces.size(); ++piece)
                        CHECK(pieces[piece].first == pieces[piece - 1].end);
                    CHECK(pieces.back().end == rows_of(plan->stages[stage].lowered.call).end);
                }
            }
        }
    }

    TEST_CASE("memories that are needed at one moment do not overlap, and the arena is near the floor") {
        Graph graph;
        const Value color = graph.input(Resource::color, {64, 32});
        Value x = color;
        std::vector<Value> layers;
        for (const int width : {16, 64, 8, 32, 4, 3}) {
            x = graph.convolution(x, zero_parameters(width, graph.shape(x).channels), Activation::relu, "c");
            layers.push_back(x);
        }
        const Value half = graph.slice(layers[1], 0, 1);
        graph.output = graph.mix(color, x, half, "mix");
        const LayoutPlan layout = lay_out(graph, Storage::f32);
        const MemoryPlan plan = plan_memory(layout, 128);
        const auto place = [&](Value value) { return plan.places[layout.layouts[value].memory]; };
        const auto apart = [&](Value a, Value b) {
            return place(a).offset + place(a).bytes <= place(b).offset ||
                   place(b).offset + place(b).bytes <= place(a).offset;
        };
        for (size_t layer = 1; layer < layers.size(); ++layer) CHECK(apart(layers[layer - 1], layers[layer]));
        for (const Value layer : layers) CHECK(apart(layer, color));  // color is read last
        for (size_t layer = 2; layer < layers.size(); ++layer) CHECK(apart(layers[1], layers[layer]));
        for (const MemoryPlan::Place& each : plan.places) CHECK(each.offset % 128 == 0);
        // While the fourth layer is made; the second is kept for its first channel.
        CHECK(plan.peak_live_bytes == (3 + 64 + 8 + 32) * 64 * 32 * sizeof(float));
        CHECK(plan.bytes < 1.1 * plan.peak_live_bytes);
        size_t sum = 0;
        for (const MemoryPlan::Place& each : plan.places) sum += each.bytes;
        CHECK(plan.bytes < sum);
    }

    TEST_CASE("a state that is read before it is written anew has one memory") {
        Graph graph;
        const Value history = graph.previous({3, 8, 8}, "history");
        const Value blurred = graph.convolution(history, zero_parameters(8, 3), Activation::none, "c");
        graph.output = graph.convolution(blurred, zero_parameters(3, 8), Activation::none, "d");
        graph.carry(history, graph.output);
        const LayoutPlan layout = lay_out(graph, Storage::f32);
        const MemoryPlan plan = plan_memory(layout, 4);
        CHECK_FALSE(plan.alternates[0]);
        const int previous = layout.layouts[history].memory, next = layout.layouts[graph.output].memory;
        CHECK(plan.places[previous].offset == plan.places[next].offset);
    }

    TEST_CASE("a state that is read while it is written has two memories that alternate") {
        Graph graph;
        const Value history = graph.previous({3, 8, 8}, "history");
        graph.output = graph.convolution(history, zero_parameters(3, 3), Activation::none, "c");
        graph.carry(history, graph.output);
        const LayoutPlan layout = lay_out(graph, Storage::f32);
        const MemoryPlan plan = plan_memory(layout, 4);
        CHECK(plan.alternates[0]);
        const int previous = layout.layouts[history].memory, next = layout.layouts[graph.output].memory;
        CHECK(plan.places[previous].offset != plan.places[next].offset);
    }

    TEST_CASE("a table's entry serves jitters within 0.001 pixel") {
        JitterSets sets({{0.0f, 0.0f}, {0.25f, -0.25f}}, 0);
        CHECK(sets.select({0.2504f, -0.2504f}).set == 1);
        CHECK(sets.largest_distance() == 0);
        CHECK(sets.select({0.0f, 0.02f}).set == 0);
        CHECK_FALSE(sets.select({0.0f, 0.02f}).compute);
        CHECK(sets.largest_distance() == doctest::Approx(0.02));
    }

    TEST_CASE("kernels of other jitters are computed once, and the least recently used make room") {
        JitterSets sets({{0.0f, 0.0f}}, 2);
        CHECK(sets.select({0.0005f, 0.0f}).set == 0);
        const auto first = sets.select({0.1f, 0.0f});
        CHECK(first.compute);
        CHECK(first.set >= 1);
        const auto second = sets.select({0.2f, 0.0f});
        CHECK(second.compute);
        CHECK(second.set != first.set);
        CHECK_FALSE(sets.select({0.1f, 0.0f}).compute);
        const auto third = sets.select({0.3f, 0.0f});  // 0.2 was used longest ago
        CHECK(third.compute);
        CHECK(third.set == second.set);
        CHECK_FALSE(sets.select({0.1f, 0.0f}).compute);
        CHECK(sets.select({0.2f, 0.0f}).compute);
        CHECK(sets.largest_distance() == 0);
    }

    TEST_CASE("a program presents the output where it is the last to write it, as it is stored and shown") {
        const auto presenting = [](const Graph& graph, const PlanOptions& options) {
            DeviceProfile profile;
            profile.half_storage = true;
            const auto plan = make_plan(graph, options, profile,
                                        [&](const Problem& problem) { return built_in_selection(problem, profile); });
            return plan->presenting < 0 ? std::string() : plan->stages[plan->presenting].problem.node.name;
        };
        Graph graph;
        const Value color = graph.input(Resource::color, {6, 4});
        const Value blend = graph.clamp(color, 0, 1, "blend");
        graph.output = blend;
        PlanOptions options;
        CHECK(presenting(graph, options) == "blend");
        SUBCASE("not as light") { options.color_space = ColorSpace::linear; }
        SUBCASE("not in half") { options.precision = Precision::fp16; }
        SUBCASE("not before something is placed on it") {
            graph.output = graph.place(blend, graph.input(Resource::color, {3, 2}), 2, "placed");
        }
        CHECK(presenting(graph, options).empty());
    }
}
