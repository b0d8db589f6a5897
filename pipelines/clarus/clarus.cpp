#include <algorithm>
#include <string>
#include <string_view>
#include <utility>

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

/// The layers of a file, as many as it has weights or biases for: two at least.
int layer_count(const io::Safetensors& model) {
    const auto count = [&](std::string_view kind) {
        return static_cast<int>(std::ranges::count_if(model.tensors(), [&](const auto& entry) {
            return entry.first.starts_with("layers.") && entry.first.ends_with(kind);
        }));
    };
    return std::max({count(".weight"), count(".bias"), 2});
}

}  // namespace

graph::Graph build_clarus(const io::Safetensors& model, int scale, Size render, const PipelineOptions&) {
    const Size output{render.width * scale, render.height * scale};
    Graph graph;
    const Value color = graph.input(Resource::color, render);
    const Value depth = graph.input(Resource::depth, render);
    const Value motion = graph.input(Resource::motion, render);

    // Step 1: fsr2's.
    const auto [trust, collected] = collected_history(graph, color, depth, motion, scale, output);

    // Steps 2 and 3.
    Value x = graph.concat({color, graph.plane(FrameScalar::jitter_x, render),
                            graph.plane(FrameScalar::jitter_y, render), trust, graph.space_to_depth(collected, scale)},
                           "network input");
    const int layers = layer_count(model);
    for (int layer = 0; layer < layers; ++layer) {
        const bool last = layer + 1 == layers;
        Parameters weights = read_layer(model, "layers." + std::to_string(layer), last ? 3 * scale * scale : kAny,
                                        graph.shape(x).channels);
        x = graph.convolution(x, std::move(weights), last ? Activation::none : Activation::relu,
                              "convolution " + std::to_string(layer + 1));
    }
    const Value details = graph.depth_to_space(x, scale), seen = graph.slice(collected, 0, 3);
    graph.output = graph.hold(graph.sum(seen, details, "output"), color, seen, scale);

    graph.views.insert({{"collected", seen},
                        {"details", details},
                        {"input_motion", motion},
                        {"input_depth", depth},
                        {"input_color", color},
                        {"output", graph.output}});
    return graph;
}

}  // namespace clarus::pipelines
