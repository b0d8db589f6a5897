#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "base/error.h"
#include "base/parse.h"
#include "base/rounding.h"
#include "pipelines/layer.h"
#include "pipelines/pipeline.h"

// NSS: Arm's Neural Super Sampling, version 1, quality `high` (docs/nss.md).
namespace clarus::pipelines {
namespace {

using graph::Activation;
using graph::Graph;
using graph::Parameters;
using graph::Resource;
using graph::Value;

/// The layer after each pixel was repeated 2×2, as one at the image's own size whose channels are those of the four
/// pixels: what is left of it is depth-to-space by 2.
Parameters after_repetition(const Parameters& layer) {
    Parameters result{4 * layer.out_channels, layer.in_channels};
    result.weights.resize(result.weights_per_set());
    for (int out = 0; out < layer.out_channels; ++out) {
        for (int phase = 0; phase < 4; ++phase) {
            const int channel = 4 * out + phase;
            result.biases.push_back(layer.biases[out]);
            for (int in = 0; in < layer.in_channels; ++in) {
                const float* from = &layer.weights[static_cast<size_t>(out * layer.in_channels + in) * 9];
                float* to = &result.weights[static_cast<size_t>(channel * layer.in_channels + in) * 9];
                // Of 3 rows beginning one above row `phase / 2` of a pair, which pair each is of.
                for (int y = 0; y < 3; ++y)
                    for (int x = 0; x < 3; ++x)
                        to[(phase / 2 + y + 1) / 2 * 3 + (phase % 2 + x + 1) / 2] += from[3 * y + x];
            }
        }
    }
    return result;
}

/// The layer of stride 2, as one of stride 1 of the image from space to depth by 2: convolutions of stride 1 are what
/// there are fast kernels for.
Parameters from_depth(const Parameters& layer) {
    Parameters result{layer.out_channels, 4 * layer.in_channels};
    result.biases = layer.biases;
    result.weights.resize(result.weights_per_set());
    for (int out = 0; out < layer.out_channels; ++out) {
        for (int in = 0; in < layer.in_channels; ++in) {
            const float* from = &layer.weights[static_cast<size_t>(out * layer.in_channels + in) * 9];
            float* to = &result.weights[static_cast<size_t>(out * result.in_channels + 4 * in) * 9];
            // Rows 2i - 1, 2i and 2i + 1 are the second of cell i - 1 and both of cell i.
            for (int y = 0; y < 3; ++y)
                for (int x = 0; x < 3; ++x)
                    to[((y + 1) % 2 * 2 + (x + 1) % 2) * 9 + (y + 1) / 2 * 3 + (x + 1) / 2] = from[3 * y + x];
        }
    }
    return result;
}

class Network {
  public:
    Network(Graph& graph, const io::Safetensors& model) : graph_(graph), model_(model) {}

    Value layer(Value x, int index, int out) {
        return graph_.convolution(x, read("conv2d_" + std::to_string(index), out, graph_.shape(x).channels),
                                  Activation::relu, "network: convolution " + std::to_string(index));
    }
    Value halving_layer(Value x, int index, int out) {
        const Parameters weights = read("conv2d_" + std::to_string(index), out, graph_.shape(x).channels);
        return graph_.convolution(graph_.space_to_depth(x, 2), from_depth(weights), Activation::relu,
                                  "network: convolution " + std::to_string(index));
    }
    Value repeated_layer(Value x, int index, int out) {
        const Parameters weights = read("conv2d_" + std::to_string(index), out, graph_.shape(x).channels);
        return graph_.depth_to_space(graph_.convolution(x, after_repetition(weights), Activation::relu,
                                                        "network: convolution " + std::to_string(index)),
                                     2);
    }
    Value kernels(Value x) {
        const Value raw = graph_.convolution(x, read("kpn_params", graph::kNssKernel, graph_.shape(x).channels),
                                             Activation::none, "network: kernel convolution");
        return graph_.sigmoid(raw, "network: kernels");
    }
    Value temporal(Value x) {
        const Parameters weights = read("temporal_params_out_conv", graph::kNssTemporal, graph_.shape(x).channels);
        const Value raw =
            graph_.convolution(x, after_repetition(weights), Activation::none, "network: temporal convolution");
        return graph_.sigmoid(graph_.depth_to_space(raw, 2), "network: temporal parameters");
    }

  private:
    Parameters read(const std::string& name, int out, int in) const {
        return read_layer(model_, "autoencoder." + name + ".conv2d", out, in);
    }

    Graph& graph_;
    const io::Safetensors& model_;
};

double white_of(const io::Safetensors& model) {
    const auto found = model.metadata().find("white");
    if (found == model.metadata().end()) return std::numeric_limits<double>::infinity();
    const std::optional<double> white = parse_number(found->second);
    if (!white || !(*white >= 1))
        fail(ErrorKind::file, "{}: the metadata \"white\" must be a number from 1 or \"inf\", not \"{}\"",
             model.path().string(), found->second);
    return *white;
}

}  // namespace

graph::Graph build_nss(const io::Safetensors& model, double scale, Size render, const PipelineOptions&) {
    const double white = white_of(model);
    const Size output = scaled(render, scale);
    const int padded_height = round_up(render.height, graph::kNssPaddedTo),
              padded_width = round_up(render.width, graph::kNssPaddedTo);
    Graph graph;
    const Value color = graph.input(Resource::color, render);
    const Value depth = graph.input(Resource::depth, render);
    const Value motion = graph.input(Resource::motion, render);
    const Value history = graph.previous({3, output.height, output.width}, "history");
    const Value fed_back = graph.previous({graph::kNssTemporal, padded_height, padded_width}, "temporal parameters");
    const Value derivative = graph.previous({graph::kNssDerivative, render.height, render.width}, "derivative");

    const Value radiance = graph.radiance(color, white);
    const Value guide = graph.nss_guide(depth, motion);
    const Value flicker = graph.nss_flicker(radiance, guide, derivative);
    const Value seen = graph.nss_input(radiance, guide, flicker, history, fed_back);

    Network network(graph, model);
    const Value half = network.layer(network.halving_layer(seen, 0, 32), 1, 32);
    const Value quarter = network.layer(network.halving_layer(half, 2, 32), 3, 32);
    Value x = network.layer(network.layer(network.halving_layer(quarter, 4, 64), 5, 64), 6, 32);
    x = network.layer(graph.concat({network.repeated_layer(x, 7, 16), quarter}), 8, 32);
    const Value kernels = network.kernels(x);
    x = network.layer(graph.concat({network.repeated_layer(x, 9, 16), half}), 10, 16);
    const Value temporal = network.temporal(network.layer(x, 11, 16));

    const Value resolved = graph.nss_resolve(radiance, guide, kernels, temporal, history);
    graph.output = graph.display(resolved, white);
    graph.history_trust = temporal;
    graph.carry(history, resolved);
    graph.carry(fed_back, temporal);
    graph.carry(derivative, graph.slice(flicker, 0, graph::kNssDerivative));
    const Value motion_view = graph.slice(guide, 0, 2);
    graph.views = {{"motion", motion_view},
                   {"disocclusion", graph.slice(guide, 2, 1)},
                   {"instability", graph.slice(flicker, graph::kNssDerivative, 1)},
                   {"temporal", temporal},
                   {"input_motion", motion},
                   {"input_depth", depth},
                   {"input_color", color},
                   {"output", graph.output}};
    return graph;
}

}  // namespace clarus::pipelines
