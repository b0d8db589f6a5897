#include <string>
#include <utility>

#include "pipelines/history.h"
#include "pipelines/layer.h"
#include "pipelines/pipeline.h"

// MNSS: Yang et al. 2022, "MNSS: Neural supersampling framework for real-time rendering on mobile devices"
// (docs/pipelines.md, "MNSS"). Stages are named after the paper's modules (table 3).
namespace clarus::pipelines {

using graph::Activation;
using graph::Border;
using graph::Graph;
using graph::Parameters;
using graph::Resource;
using graph::Shift;
using graph::Value;

graph::Graph build_mnss(const io::Safetensors& model, int scale, Size render, const PipelineOptions&) {
    const HistoryOptions options = history_options(model);
    const Size output{render.width * scale, render.height * scale};
    Graph graph;
    const Value color = graph.input(Resource::color, render);
    const Value depth = graph.input(Resource::depth, render);
    const Value motion = graph.input(Resource::motion, render);
    const Value frame = graph.concat({color, depth});
    // Last frame's output and upsampled depth, side by side: one warp serves both.
    const Value history = graph.previous({4, output.height, output.width}, "history");

    // Steps 1 and 2.
    Value hr_motion;
    if (options.checked) {
        const CheckedHistory checked = checked_history(graph, motion, depth, scale, output);
        hr_motion = checked.motion;
        graph.views["validity"] = graph.validity(checked.checked);
    } else {
        hr_motion = graph.upsample_motion(motion, scale, "warping: motion");
    }
    const Value warped = graph.warp(history, hr_motion, 1, Border::clamp, frame, scale, "warping: history");
    const Value warped_color = graph.slice(warped, 0, 3);

    // Step 3.
    const Value upsampled =
        graph.upsample(graph.slice(frame, 0, 3), scale, Shift::jitter, "inpainting: upsampled color");
    const Value picked = graph.pick(warped, scale, "inpainting: history at the samples");
    Value x = graph.difference(frame, picked, "inpainting: difference");
    x = graph.convolution(x, read_layer(model, "inpaint", 1, 4), Activation::none, "inpainting: convolution");
    x = graph.sigmoid(x, "inpainting: weight");
    const Value weight = graph.upsample(x, scale, Shift::jitter, "inpainting: upsampled weight");
    const Value inpainted = graph.mix(upsampled, warped_color, weight, "inpainting: history");

    // Step 4.
    x = graph.concat({color, graph.average_pool(inpainted, scale, "blending: pooled history")});
    Parameters antialias = read_layer(model, "antialias.0", kAny, 6);
    const int width = antialias.out_channels;
    x = graph.convolution(x, std::move(antialias), Activation::relu, "blending: antialiasing convolution 1");
    x = graph.convolution(x, read_layer(model, "antialias.1", 3, width), Activation::none,
                          "blending: antialiasing convolution 2");
    const Value antialiased = graph.sum(color, x, "blending: antialiased samples");

    // Step 5.
    const Value placed = graph.place(inpainted, antialiased, scale, "blending: placed samples");
    x = placed;
    for (int layer = 0; layer < 4; ++layer) {
        const bool last = layer == 3;
        Parameters weights =
            read_layer(model, "reconstruct." + std::to_string(layer), last ? 3 : kAny, graph.shape(x).channels);
        x = graph.convolution(x, std::move(weights), last ? Activation::none : Activation::relu,
                              "blending: convolution " + std::to_string(layer + 1));
    }
    const Value blended = graph.sum(placed, x, "blending: output");
    graph.output =
        options.held ? graph.hold(blended, color, warped_color, scale) : graph.clamp(blended, 0, 1, "blending: output");
    // Only now, so that this frame's state may take the place of the last one's.
    const Value upsampled_depth =
        graph.upsample(graph.slice(frame, 3, 1), scale, Shift::jitter, "warping: upsampled depth");
    graph.carry(history, graph.concat({graph.output, upsampled_depth}));

    graph.views.insert({{"motion", hr_motion},
                        {"warped", warped_color},
                        {"weight", weight},
                        {"history", inpainted},
                        {"antialiased", antialiased},
                        {"placed", placed},
                        {"input_motion", motion},
                        {"input_depth", depth},
                        {"input_color", color},
                        {"output", graph.output}});
    return graph;
}

}  // namespace clarus::pipelines
