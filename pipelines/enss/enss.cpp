#include <algorithm>
#include <array>
#include <string>
#include <string_view>
#include <utility>

#include "base/error.h"
#include "pipelines/history.h"
#include "pipelines/layer.h"
#include "pipelines/pipeline.h"

// ENSS: Mercier et al. 2023, "Efficient neural supersampling on a novel gaming dataset" (docs/pipelines.md, "ENSS").
namespace clarus::pipelines {
namespace {

using graph::Activation;
using graph::Border;
using graph::FrameScalar;
using graph::Graph;
using graph::Parameters;
using graph::Resource;
using graph::Shift;
using graph::Value;

/// Layer widths, read off the model's tensors.
struct Widths {
    int features;  // f
    int body;      // m
    int inputs;    // of the first convolution: 6 + 4s², with checked history 7 + 4s²
    int outputs;   // of the last: 5s²
};

/// Whether the model has any tensor of a group, and then it must have all of them: `require` says which is missing.
bool has_any(const io::Safetensors& model, std::string_view prefix) {
    return std::any_of(model.tensors().begin(), model.tensors().end(),
                       [&](const auto& entry) { return entry.first.starts_with(prefix); });
}

bool has_table(const io::Safetensors& model) {
    return has_any(model, "first.") || has_any(model, "last.") || has_any(model, "jitter");
}

Widths read_widths(const io::Safetensors& model, int scale, bool checked) {
    Widths widths{0, 0, (checked ? 7 : 6) + 4 * scale * scale, 5 * scale * scale};
    if (has_table(model)) {
        const io::Tensor& first =
            model.require("first.weight", std::array<int64_t, 5>{kAny, kAny, widths.inputs, 3, 3});
        chosen_extent(model, "first.weight", first.shape[0]);
        widths.features = chosen_extent(model, "first.weight", first.shape[1]);
    } else {
        widths.features = model.require_integer("features", 1, 1 << 12);
    }
    // As many layers as there are weights or biases for, so that what one of them lacks is missed when it is read.
    const auto count = [&](std::string_view kind) {
        return std::count_if(model.tensors().begin(), model.tensors().end(), [&](const auto& entry) {
            return entry.first.starts_with("body.") && entry.first.ends_with(kind);
        });
    };
    widths.body = static_cast<int>(std::max(count(".weight"), count(".bias")));
    return widths;
}

/// A jitter-conditioned layer: the sets of its table, none where the model has only the predictor.
Parameters conditioned_layer(const io::Safetensors& model, const std::string& name, int out, int in, int sets) {
    Parameters parameters{out, in, sets, true};
    parameters.layer = name;
    if (sets == 0) return parameters;
    read_weights(model, name, parameters, true);
    if (parameters.quantized && has_any(model, "mlp."))
        fail(ErrorKind::file, "{}: layer {} is quantized, and a perceptron (mlp.0.weight) makes floating-point kernels",
             model.path().string(), name);
    return parameters;
}

std::vector<Vec2> read_table(const io::Safetensors& model, int sets) {
    std::vector<Vec2> table;
    if (sets == 0 || (sets == 1 && !model.has("jitter"))) return table;
    const std::vector<float> values = finite_floats(model, model.require("jitter", std::array<int64_t, 2>{sets, 2}));
    for (int set = 0; set < sets; ++set) table.push_back({values[2 * set], values[2 * set + 1]});
    return table;
}

std::vector<graph::DenseLayer> read_predictor(const io::Safetensors& model, int outputs) {
    constexpr int kLayers = 7;
    std::vector<graph::DenseLayer> layers;
    if (!has_any(model, "mlp.")) return layers;
    int64_t in = 2;
    for (int index = 0; index < kLayers; ++index) {
        const std::string name = "mlp." + std::to_string(index);
        const int64_t expected = index + 1 < kLayers ? kAny : outputs;
        const io::Tensor& weight = model.require(name + ".weight", std::array<int64_t, 2>{expected, in});
        const int64_t out = index + 1 < kLayers ? chosen_extent(model, name + ".weight", weight.shape[0]) : outputs;
        const io::Tensor& bias = model.require(name + ".bias", std::array<int64_t, 1>{out});
        layers.push_back(
            {static_cast<int>(out), static_cast<int>(in), finite_floats(model, weight), finite_floats(model, bias)});
        in = out;
    }
    return layers;
}

int table_sets(const io::Safetensors& model) {
    if (!has_table(model)) return 0;
    return static_cast<int>(model.tensors().at("first.weight").shape[0]);
}

}  // namespace

graph::Graph build_enss(const io::Safetensors& model, int scale, Size render, const PipelineOptions&) {
    const HistoryOptions options = history_options(model);
    const Widths widths = read_widths(model, scale, options.checked);
    const int sets = table_sets(model);
    Parameters first = conditioned_layer(model, "first", widths.features, widths.inputs, sets);
    Parameters last = conditioned_layer(model, "last", widths.outputs, widths.features, sets);
    const int predicted =
        static_cast<int>(first.weights_per_set() + last.weights_per_set()) + widths.features + widths.outputs;
    graph::JitterKernels kernels{read_table(model, sets), read_predictor(model, predicted), {}};
    if (sets == 0 && kernels.predictor.empty())
        fail(ErrorKind::file, "{}: neither a table of kernels (first.weight) nor a perceptron (mlp.0.weight)",
             model.path().string());

    const Size output{render.width * scale, render.height * scale};
    Graph graph;
    const Value color = graph.input(Resource::color, render);
    const Value depth = graph.input(Resource::depth, render);
    const Value motion = graph.input(Resource::motion, render);
    // Last frame's output and feature, side by side: one warp serves both.
    const Value history = graph.previous({4, output.height, output.width}, "history");

    // Steps 1 and 2.
    std::vector<Value> seen{color, depth, graph.plane(FrameScalar::jitter_x, render),
                            graph.plane(FrameScalar::jitter_y, render)};
    Value hr_motion;
    if (options.checked) {
        const CheckedHistory checked = checked_history(graph, motion, depth, scale, output);
        hr_motion = checked.motion;
        seen.push_back(graph.validity(checked.checked));
        graph.views["validity"] = seen.back();
    } else {
        hr_motion = graph.dilate(motion, depth, scale);
    }
    const Value warped =
        graph.warp(history, hr_motion, options.checked ? 1 : graph::kDilationBlock, Border::clamp, color, scale);
    const Value warped_color = graph.slice(warped, 0, 3);

    // Steps 3 and 4.
    seen.push_back(graph.space_to_depth(warped, scale));
    Value x = graph.concat(std::move(seen), "network input");
    x = graph.convolution(x, std::move(first), Activation::relu, "first convolution");
    kernels.conditioned.push_back(static_cast<int>(graph.parameters.size()) - 1);
    for (int layer = 0; layer < widths.body; ++layer)
        x = graph.convolution(x, read_layer(model, "body." + std::to_string(layer), widths.features, widths.features),
                              Activation::relu, "convolution " + std::to_string(layer + 1));
    x = graph.convolution(x, std::move(last), Activation::none, "last convolution");
    kernels.conditioned.push_back(static_cast<int>(graph.parameters.size()) - 1);
    graph.jitter_kernels = std::move(kernels);

    // Steps 5 and 6.
    const Value predictions = graph.depth_to_space(x, scale);
    const Value alpha = graph.sigmoid(graph.slice(predictions, 0, 1), "alpha");
    const Value candidate = graph.slice(predictions, 1, 3);
    const Value feature = graph.slice(predictions, 4, 1);
    const Value blend = graph.mix(candidate, warped_color, alpha, "blend");
    graph.output = options.held ? graph.hold(blend, color, warped_color, scale) : graph.clamp(blend, 0, 1, "blend");
    graph.carry(history, graph.concat({graph.output, feature}));

    graph.views.insert({{"alpha", alpha},
                        {"candidate", candidate},
                        {"feature", feature},
                        {"motion", hr_motion},
                        {"warped", warped_color},
                        {"input_motion", motion},
                        {"input_depth", depth},
                        {"input_color", color},
                        {"output", graph.output}});
    return graph;
}

}  // namespace clarus::pipelines
