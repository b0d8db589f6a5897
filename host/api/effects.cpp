#include "api/effects.h"

#include "graph/passes.h"

namespace clarus {

graph::Graph with_effects(const graph::Graph& graph, const UpscalerOptions& options) {
    graph::Graph result = graph;
    if (options.antialias_input == Antialiasing::mlaa)
        result = graph::with_changed_color(
            graph, [](graph::Graph& changed, graph::Value color) { return changed.mlaa(color, "mlaa of the input"); });
    if (options.antialias == Antialiasing::mlaa) result.output = result.mlaa(result.output, "mlaa");
    if (options.sharpen > 0) result.output = result.sharpen(result.output, options.sharpen, "enhancement: sharpening");
    return result;
}

}  // namespace clarus
