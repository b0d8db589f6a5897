#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/error.h"
#include "base/rounding.h"
#include "pipelines/history.h"
#include "pipelines/layer.h"
#include "pipelines/pipeline.h"

// The project's own: the history of `fsr2`, and what a network adds to it (docs/clarus.md).
namespace clarus::pipelines {
namespace {

using graph::Activation;
using graph::FrameScalar;
using graph::Graph;
using graph::Parameters;
using graph::Resource;
using graph::Value;

/// Whole scales that a file may hold a network for: `x2`, …. The least that reaches a scale, or nearly, for sizes are
/// rounded, is the one of its network.
constexpr int kSmallestGrid = 2, kLargestGrid = 4;
constexpr double kReach = 1.01;

bool has_network(const io::Safetensors& model, int grid) { return model.has(fmt::format("x{}.0.weight", grid)); }

int grid_of(const io::Safetensors& model, double scale) {
    for (int grid = kSmallestGrid; grid <= kLargestGrid; ++grid)
        if (kReach * grid >= scale && has_network(model, grid)) return grid;
    fail(ErrorKind::file, "{}: no network for a scale of {}: tensor x{}.0.weight is missing", model.path().string(),
         scale, std::max(kSmallestGrid, static_cast<int>(std::ceil(scale / kReach))));
}

/// As many as the file has weights or biases for: two at least.
int layer_count(const io::Safetensors& model, const std::string& network) {
    const auto count = [&](std::string_view kind) {
        return static_cast<int>(std::ranges::count_if(model.tensors(), [&](const auto& entry) {
            return entry.first.starts_with(network + ".") && entry.first.ends_with(kind);
        }));
    };
    return std::max({count(".weight"), count(".bias"), 2});
}

std::vector<Parameters> read_network(const io::Safetensors& model, int grid) {
    const std::string network = fmt::format("x{}", grid);
    const int count = layer_count(model, network);
    std::vector<Parameters> layers;
    int channels = 6 + 4 * grid * grid;
    for (int layer = 0; layer < count; ++layer) {
        const bool last = layer + 1 == count;
        layers.push_back(
            read_layer(model, fmt::format("{}.{}", network, layer), last ? 3 * grid * grid : kAny, channels));
        channels = layers.back().out_channels;
    }
    return layers;
}

Value convolutions(Graph& graph, Value x, std::vector<Parameters> layers) {
    for (Parameters& layer : layers) {
        const bool last = &layer == &layers.back();
        const std::string name = fmt::format("convolution {}", &layer - layers.data() + 1);
        x = graph.convolution(x, std::move(layer), last ? Activation::none : Activation::relu, name);
    }
    return x;
}

}  // namespace

graph::Graph build_clarus(const io::Safetensors& model, double scale, Size render, const PipelineOptions&) {
    const int grid = grid_of(model, scale);
    const Size output = scaled(render, scale), size_on_grid{render.width * grid, render.height * grid};
    const bool resampled = scale != grid;
    Graph graph;
    const Value color = graph.input(Resource::color, render);
    const Value depth = graph.input(Resource::depth, render);
    const Value motion = graph.input(Resource::motion, render);

    // Step 1: fsr2's.
    const auto [trust, collected] = collected_history(graph, color, depth, motion, scale, output);

    // Steps 2 and 3.
    const Value on_grid =
        resampled ? graph.resample_freely(collected, grid / scale, size_on_grid, "collected on the grid") : collected;
    Value x = graph.concat({color, graph.plane(FrameScalar::jitter_x, render),
                            graph.plane(FrameScalar::jitter_y, render), trust, graph.space_to_depth(on_grid, grid)},
                           "network input");
    // Where the size changes from frame to frame, weights are known by their number: every graph counts all networks'.
    for (int each = kSmallestGrid; each <= kLargestGrid; ++each) {
        if (!has_network(model, each)) continue;
        std::vector<Parameters> layers = read_network(model, each);
        if (each == grid) {
            x = convolutions(graph, x, std::move(layers));
            continue;
        }
        for (Parameters& layer : layers) graph.parameters.push_back(std::make_shared<Parameters>(std::move(layer)));
    }
    Value details = graph.depth_to_space(x, grid);
    if (resampled) details = graph.resample_freely(details, scale / grid, output, "details");

    // Step 4.
    const Value seen = graph.slice(collected, 0, 3), free = graph.sum(seen, details, "output");
    const auto spread = [&](Value value) {
        return resampled ? graph.resample(value, graph::Filter::nearest, scale, output, graph::Shift::none)
                         : graph.tiles(value, grid);
    };
    graph.output = graph.hold(free, seen, graph.range(color, on_grid, grid), spread);

    graph.views.insert({{"collected", seen},
                        {"details", details},
                        {"input_motion", motion},
                        {"input_depth", depth},
                        {"input_color", color},
                        {"output", graph.output}});
    return graph;
}

}  // namespace clarus::pipelines
