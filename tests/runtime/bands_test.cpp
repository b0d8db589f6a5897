#include "runtime/bands.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "graph/passes.h"
#include "runtime/memory_plan.h"
#include "zero_parameters.h"

using namespace clarus;
using namespace clarus::graph;
using namespace clarus::runtime;

namespace {

/// A device on which bands begin at multiples of so many rows.
DeviceProfile with_granule(int granule) {
    DeviceProfile profile;
    profile.device_class = granule == 8 ? DeviceClass::gpu : DeviceClass::cpu;
    profile.float_vector_width = 16;
    REQUIRE(band_granule(profile) == granule);
    return profile;
}

Value layer(Graph& graph, Value image, int out) {
    return graph.convolution(image, zero_parameters(out, graph.shape(image).channels), Activation::relu, "layer");
}

/// Zero-upsampled colour through a U-Net of three levels, its input made larger and its output cropped.
Graph unet(Size render) {
    Graph graph;
    const Value image = graph.zero_upsample(layer(graph, graph.input(Resource::color, render), 8), 2);
    const Size output{2 * render.width, 2 * render.height};
    const Size whole{(output.width + 3) / 4 * 4, (output.height + 3) / 4 * 4};
    const Value first = layer(graph, graph.replicate_to(image, whole), 8);
    const Value second = layer(graph, graph.max_pool(layer(graph, first, 8), "pool"), 8);
    Value x = layer(graph, layer(graph, graph.max_pool(second, "pool"), 16), 16);
    x = layer(graph, graph.concat({graph.upsample(x, 2, Shift::none, "up"), second}), 8);
    x = graph.concat({graph.upsample(x, 2, Shift::none, "up"), first});
    x = graph.convolution(x, zero_parameters(3, 16), Activation::none, "last", output);
    graph.output = graph.clamp(x, 0, 1, "output");
    return graph;
}

/// As plans are made of it.
Graph fused_unet(Size render) { return fuse_convolution_inputs(unet(render)); }

/// Upsampled with the jitter, then a stride.
Graph strided(Size render) {
    Graph graph;
    Value x = layer(graph, graph.upsample(graph.input(Resource::color, render), 3, Shift::jitter, "up"), 8);
    Parameters halving = zero_parameters(8, 8);
    halving.kernel = 5;
    halving.stride = 2;
    halving.weights.assign(halving.weights_per_set(), 0);
    x = layer(graph, graph.convolution(x, halving, Activation::relu, "half"), 8);
    x = graph.upsample(x, 2, Shift::motion_jitter, "up");
    graph.output = graph.clamp(layer(graph, x, 3), 0, 1, "output");
    return graph;
}

/// Rows of an input that a node reads for one row of its result.
std::pair<int, int> rows_read(const Graph& graph, const Node& node, size_t position, int row) {
    const int height = graph.shape(node.inputs[position]).height;
    std::pair<int, int> rows{row, row};
    if (const auto* convolution = std::get_if<Convolution>(&node.op)) {
        const Parameters& layer = *graph.parameters[convolution->parameters];
        rows = {layer.stride * row - layer.kernel / 2, layer.stride * row + layer.kernel / 2};
        if (!convolution->readings.empty()) {
            const auto [first, last] =
                std::pair(std::max(rows.first, 0), std::min(rows.second, convolution->height - 1));
            if (convolution->readings[position] == Reading::pooled) rows = {2 * first, 2 * last + 1};
            if (convolution->readings[position] == Reading::upsampled) rows = {(first + 1) / 2 - 1, (last + 1) / 2};
        }
    }
    if (std::holds_alternative<MaxPool>(node.op)) rows = {2 * row, 2 * row + 1};
    if (const auto* upsample = std::get_if<Upsample>(&node.op)) {
        const double centre = (row + 0.5) / upsample->scale - 0.5, jitter = upsample->shift == Shift::none ? 0 : 1;
        rows = {static_cast<int>(std::floor(centre - jitter)), static_cast<int>(std::floor(centre + jitter)) + 1};
    }
    return {std::clamp(rows.first, 0, height - 1), std::clamp(rows.second, 0, height - 1)};
}

/// Goes through a plan band by band and checks that every row that is read is there.
class Simulation {
  public:
    explicit Simulation(const LayoutPlan& plan) : plan_(plan) {}

    void run(const Band& band) {
        const Node& node = plan_.graph.nodes[band.value];
        for (int row = band.first; row < band.end; ++row) {
            for (size_t position = 0; position < node.inputs.size(); ++position) {
                const auto [first, last] = rows_read(plan_.graph, node, position, row);
                for (int each = first; each <= last; ++each) check(node.inputs[position], each);
            }
        }
        for (int row = band.first; row < band.end; ++row) {
            there_.insert({band.value, row});
            const TensorLayout& layout = plan_.layouts[band.value];
            if (layout.ring > 0)
                std::erase_if(there_, [&](const auto& entry) {
                    return plan_.layouts[entry.first].memory == layout.memory && entry.second == row - layout.ring;
                });
        }
    }

    int rows_of(Value value) const {
        return static_cast<int>(
            std::count_if(there_.begin(), there_.end(), [&](const auto& entry) { return entry.first == value; }));
    }

  private:
    void check(Value value, int row) {
        const Node& node = plan_.graph.nodes[value];
        if (std::holds_alternative<Input>(node.op)) return;
        if (const auto* samples = std::get_if<ZeroUpsample>(&node.op))
            return check(node.inputs[0], row / samples->scale);
        if (std::holds_alternative<Concat>(node.op)) {
            for (const Value part : node.inputs) check(part, row);
            return;
        }
        if (!there_.contains({value, row})) FAIL("row " << row << " of value " << value << " is not there");
    }

    const LayoutPlan& plan_;
    std::set<std::pair<Value, int>> there_;
};

}  // namespace

TEST_SUITE("small") {
    TEST_CASE("in bands every row is made before it is read, and kept until then") {
        for (const auto build : {unet, fused_unet, strided}) {
            for (const int height : {1, 7, 50, 101}) {
                for (const auto& [rows, granule] : {std::pair{4, 4}, {8, 4}, {20, 4}, {8, 8}, {64, 8}}) {
                    CAPTURE(height);
                    CAPTURE(rows);
                    LayoutPlan plan = lay_out(build({6, height}), Storage::f32);
                    const std::vector<BandedNodes> banded = plan_bands(plan, rows, with_granule(granule)).banded;
                    REQUIRE(banded.size() == 1);
                    Simulation simulation(plan);
                    std::map<Value, int> done;
                    for (const Band& band : banded[0].order) {
                        CHECK(band.first == done[band.value]);
                        CHECK(band.first % granule == 0);
                        done[band.value] = band.end;
                        simulation.run(band);
                    }
                    CHECK(simulation.rows_of(plan.graph.output) == plan.graph.shape(plan.graph.output).height);
                }
            }
        }
    }

    TEST_CASE("what is kept does not grow with the image's height") {
        const auto bytes = [](int height, int rows) {
            LayoutPlan plan = lay_out(unet({16, height}), Storage::f32);
            const std::vector<BandedNodes> banded = plan_bands(plan, rows, with_granule(4)).banded;
            // Without colour and the output, which are whole.
            return plan_memory(plan, 128, banded).bytes - 16u * height * sizeof(float) * (4 + 4 * 4);
        };
        CHECK(bytes(2000, 16) < bytes(1000, 16) + 4096);
        CHECK(4 * bytes(1000, 16) < bytes(1000, 4000));
    }

    TEST_CASE("small images stay whole, unless the device is small, too") {
        LayoutPlan plan = lay_out(unet({16, 100}), Storage::f32);
        DeviceProfile profile = with_granule(4);
        CHECK(plan_bands(plan, 0, profile).banded.empty());
        for (const TensorLayout& layout : plan.layouts) CHECK(layout.ring == 0);
        profile.max_allocation = size_t(1) << 18;
        CHECK(plan_bands(plan, 0, profile).banded.size() == 1);
    }
}

TEST_CASE("maps that are warped once a frame, the oldest first, need no memory beside their own") {
    Graph graph;
    const Value color = graph.input(Resource::color, {8, 6}), motion = graph.input(Resource::motion, {8, 6});
    const Value vectors = graph.upsample_motion(motion, 2, "motion");
    const Value next = graph.zero_upsample(layer(graph, color, 4), 2);
    std::vector<Value> maps, warped(3);
    for (int i = 0; i < 3; ++i) maps.push_back(graph.previous(graph.shape(next), "map"));
    for (int i = 2; i >= 0; --i) warped[i] = graph.warp(maps[i], vectors, Border::zero, "warp");
    graph.output = graph.convolution(graph.concat({graph.slice(warped[0], 0, 2), graph.slice(warped[2], 1, 2)}),
                                     zero_parameters(3, 4), Activation::none, "last");
    graph.carry(maps[0], next);
    for (int i = 1; i < 3; ++i) graph.carry(maps[i], warped[i - 1]);
    const LayoutPlan plan = lay_out(graph, Storage::f32);
    const MemoryPlan memory = plan_memory(plan, 128);
    CHECK_FALSE(memory.alternates[1]);
    CHECK_FALSE(memory.alternates[2]);
    CHECK(plan.layouts[maps[0]].samples == 2);
    CHECK(plan.layouts[maps[0]].previous_samples);
    CHECK(memory.places[plan.layouts[maps[0]].memory].bytes < 4 * 8 * 6 * sizeof(float) + 512);
}
