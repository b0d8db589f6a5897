#include "api/effects.h"

#include <string>

#include "graph/passes.h"

namespace clarus {

graph::Graph with_ui(const graph::Graph& graph, const StreamOptions& options) {
    if (!options.ui_format) return graph;
    graph::Graph result = graph;
    const graph::Shape made = result.shape(result.output);
    const graph::Value ui = result.input(graph::Resource::ui, {made.width, made.height});
    const graph::Value seen_through = result.linear({result.slice(ui, 3, 1)}, {-1}, 1, "ui");
    const graph::Value drawn = made.channels == 4 ? ui : result.slice(ui, 0, 3);
    result.output = result.sum(drawn, result.product(result.output, seen_through, "ui"), "ui");
    return result;
}

graph::Graph with_effects(const graph::Graph& graph, Size shown, const UpscalerOptions& options) {
    graph::Graph result = graph;
    if (options.antialias_input == Antialiasing::mlaa)
        result = graph::with_changed(
            graph, graph::input_of(graph, graph::Resource::color),
            [](graph::Graph& changed, graph::Value color) { return changed.mlaa(color, "mlaa of the input"); });
    // MLAA looks for stairs of whole pixels, which are gone once an image has been resampled. Sharpening makes up for
    // what resampling blurs, and means pixels of the display.
    if (options.antialias == Antialiasing::mlaa) result.output = result.mlaa(result.output, "mlaa");
    const graph::Shape& made = result.shape(result.output);
    if (shown != Size{made.width, made.height}) result.output = result.fit(result.output, shown, "output size");
    if (options.sharpen > 0) result.output = result.sharpen(result.output, options.sharpen, "enhancement: sharpening");
    return result;
}

graph::Graph with_alpha(const graph::Graph& graph, const AlphaSizes& sizes) {
    graph::Graph result = graph;
    const std::string name = "alpha channel";
    const graph::Shape made = result.shape(result.output);
    const Size shown{made.width, made.height};
    // What is seen through: 0 stays 0 exactly, whatever the filter's weights sum to, and so an opaque frame is opaque.
    graph::Value through = result.linear({result.input(graph::Resource::alpha, sizes.render)}, {-1}, 1, name);
    through = result.resample(through, graph::Filter::bicubic, sizes.scale, sizes.own,
                              sizes.is_jittered ? graph::Shift::jitter : graph::Shift::none);
    result.nodes[through].name = name + ": resample";
    if (shown != sizes.own) through = result.fit(through, shown, name);
    result.output = result.concat({result.output, result.linear({through}, {-1}, 1, name)}, name);
    return result;
}

}  // namespace clarus
