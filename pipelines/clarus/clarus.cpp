#include <algorithm>
#include <string>
#include <utility>

#include "base/rounding.h"
#include "pipelines/history.h"
#include "pipelines/layer.h"
#include "pipelines/pipeline.h"

// docs/clarus.md.
namespace clarus::pipelines {

using graph::Activation;
using graph::Border;
using graph::FrameScalar;
using graph::Graph;
using graph::kComposeParameters;
using graph::Parameters;
using graph::Resource;
using graph::Value;

namespace {

constexpr int kFeatures = 4;  // that are handed on to the next frame

/// As many layers as there are weights or biases for, so that what one of them lacks is missed when it is read. At
/// least one.
int count_layers(const io::Safetensors& model) {
    const auto count = [&](std::string_view kind) {
        return std::count_if(model.tensors().begin(), model.tensors().end(), [&](const auto& entry) {
            return entry.first.starts_with("layers.") && entry.first.ends_with(kind);
        });
    };
    return static_cast<int>(std::max<std::ptrdiff_t>({count(".weight"), count(".bias"), 1}));
}

}  // namespace

graph::Graph build_clarus(const io::Safetensors& model, double scale, Size render, const PipelineOptions&) {
    const Size output = scaled(render, scale);
    Graph graph;
    const Value color = graph.input(Resource::color, render);
    const Value depth = graph.input(Resource::depth, render);
    const Value motion = graph.input(Resource::motion, render);
    const Value history = graph.previous({4, output.height, output.width}, "history");
    const Value features = graph.previous({kFeatures, render.height, render.width}, "features");

    // Steps 1 and 2.
    const auto [checked, hr_motion] = checked_history(graph, motion, depth, scale, output);
    const Value past = graph.warp_sharply(history, hr_motion, color, scale);
    const Value warped_features = graph.warp(features, checked, Border::zero, "warp features");

    // Steps 3 and 4.
    Value x = graph.concat({color, graph.sense(past, depth), graph.validity(checked),
                            graph.plane(FrameScalar::jitter_x, render), graph.plane(FrameScalar::jitter_y, render),
                            graph.plane(FrameScalar::scale, render), warped_features});
    const int layers = count_layers(model);
    for (int layer = 0; layer < layers; ++layer) {
        const bool last = layer == layers - 1;
        Parameters weights = read_layer(model, "layers." + std::to_string(layer),
                                        last ? kComposeParameters + kFeatures : kAny, graph.shape(x).channels);
        x = graph.convolution(x, std::move(weights), last ? Activation::none : Activation::relu,
                              "convolution " + std::to_string(layer + 1));
    }

    // Steps 5 and 6.
    const Value composed = graph.compose(color, past, graph.slice(x, 0, kComposeParameters), scale);
    const Value next_features = graph.tanh(graph.slice(x, kComposeParameters, kFeatures), "features");
    graph.carry(history, composed);
    graph.carry(features, next_features);
    graph.output = graph.slice(composed, 0, 3);

    graph.views = {{"motion", hr_motion},
                   {"past", graph.slice(past, 0, 3)},
                   {"past_weight", graph.slice(past, 3, 1)},
                   {"weight", graph.slice(composed, 3, 1)},
                   {"features", next_features},
                   {"input_motion", motion},
                   {"input_depth", depth},
                   {"input_color", color},
                   {"output", graph.output}};
    graph.views_by_channel = {"features"};
    return graph;
}

}  // namespace clarus::pipelines
