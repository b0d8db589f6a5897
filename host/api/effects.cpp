#include "api/effects.h"

#include "graph/passes.h"

namespace clarus {

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

}  // namespace clarus
