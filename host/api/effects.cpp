#include "api/effects.h"

#include "graph/passes.h"

namespace clarus {

graph::Graph with_ui(const graph::Graph& graph, const StreamOptions& options) {
    if (!options.ui_format) return graph;
    graph::Graph result = graph;
    const graph::Shape& made = result.shape(result.output);
    const graph::Value ui = result.input(graph::Resource::ui, {made.width, made.height});
    const graph::Value seen_through = result.linear({result.slice(ui, 3, 1)}, {-1}, 1, "ui");
    result.output = result.sum(result.slice(ui, 0, 3), result.product(result.output, seen_through, "ui"), "ui");
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
    return with_ui(result, options);
}

}  // namespace clarus
