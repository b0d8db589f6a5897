#include <utility>

#include "pipelines/layer.h"
#include "pipelines/pipeline.h"

// SRPO: Gu et al. 2022, "Super-resolution by predicting offsets" (docs/pipelines.md, "SRPO").
namespace clarus::pipelines {
namespace {

using graph::Activation;
using graph::Filter;
using graph::Graph;
using graph::Parameters;
using graph::Resource;
using graph::Shift;
using graph::Value;

constexpr int kKernel = 5;

int floor_divide(int value, int by) { return value >= 0 ? value / by : -((by - 1 - value) / by); }

/// A convolution that follows nearest ×s, as one at render resolution with s² times the channels, whose depth-to-space
/// has the same result: of each HR pixel of a tile, the taps that fall on one render pixel are summed.
Parameters at_render_resolution(const Parameters& layer, int scale) {
    const int radius = layer.kernel / 2, least = floor_divide(-radius, scale);
    Parameters result{layer.out_channels * scale * scale, layer.in_channels};
    result.layer = layer.layer;
    result.kernel = 1 - 2 * least;
    result.weights.resize(result.weights_per_set());
    for (int out = 0; out < result.out_channels; ++out) {
        const int channel = out / (scale * scale), dy = out / scale % scale, dx = out % scale;
        result.biases.push_back(layer.biases[channel]);
        for (int in = 0; in < layer.in_channels; ++in) {
            for (int tap = 0; tap < layer.taps(); ++tap) {
                const int row = floor_divide(dy + tap / layer.kernel - radius, scale) - least;
                const int column = floor_divide(dx + tap % layer.kernel - radius, scale) - least;
                result.weights[((out * result.in_channels + in) * result.kernel + row) * result.kernel + column] +=
                    layer.weights[(channel * layer.in_channels + in) * layer.taps() + tap];
            }
        }
    }
    return result;
}

/// That of `conv.2`. A model has it as it is computed where it is quantized.
Parameters last_layer(const io::Safetensors& model, int in, int scale) {
    constexpr const char* kName = "conv.2";
    if (!is_quantized(model, kName)) return at_render_resolution(read_layer(model, kName, 2, in, kKernel), scale);
    return read_layer(model, kName, 2 * scale * scale, in, 1 - 2 * floor_divide(-(kKernel / 2), scale));
}

}  // namespace

graph::Graph build_srpo(const io::Safetensors& model, int scale, Size render, const PipelineOptions&) {
    Graph graph;
    const Value color = graph.input(Resource::color, render);

    // Step 1.
    Value x = color;
    for (const char* layer : {"conv.0", "conv.1"})
        x = graph.convolution(x, read_layer(model, layer, kAny, graph.shape(x).channels, kKernel), Activation::relu,
                              std::string("convolution ") + layer);
    Parameters raw = last_layer(model, graph.shape(x).channels, scale);
    raw.avoid_winograd = true;  // offsets are rounded next: what is near a half must not fall on its other side
    x = graph.convolution(x, std::move(raw), Activation::none, "convolution conv.2");
    const Value offsets = graph.depth_to_space(x, scale);

    // Steps 2 to 4.
    const Value interpolated =
        graph.resample(color, Filter::lanczos, scale, {render.width * scale, render.height * scale}, Shift::none);
    const Value mask = graph.offset_mask(offsets, "mask");
    graph.output = graph.project(color, offsets, mask, interpolated, scale, "projection and fusion");

    graph.views = {{"raw", offsets},       {"offsets", graph.round(offsets, "offsets")},
                   {"mask", mask},         {"interpolated", interpolated},
                   {"input_color", color}, {"output", graph.output}};
    return graph;
}

}  // namespace clarus::pipelines
