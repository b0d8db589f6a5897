#include "api/masks.h"

#include "graph/passes.h"

namespace clarus {

using graph::Graph;
using graph::Resource;
using graph::Value;

Graph with_masks(const Graph& graph, double scale, const StreamOptions& options) {
    const bool has_mask = options.reactive_format || options.transparency_format;
    const Value color = graph::input_of(graph, Resource::color);
    if (!has_mask || graph.states.empty() || color < 0) return graph;
    const graph::Shape& seen = graph.shape(color);
    const graph::Shape& made = graph.shape(graph.output);
    const Size render{seen.width, seen.height}, output{made.width, made.height};
    Value mask = -1;
    Graph masked = graph::with_changed(graph, graph.output, [&](Graph& changed, Value result) {
        const auto mask_of = [&](Resource resource) {
            return changed.resample(changed.input(resource, render), graph::Filter::bilinear, scale, output);
        };
        if (options.reactive_format) mask = mask_of(Resource::reactive_mask);
        if (options.transparency_format) {
            const Value other = mask_of(Resource::transparency_mask);
            mask = mask < 0 ? other : changed.channel_maximum(changed.concat({mask, other}), 1, "masks");
        }
        const Value alone = changed.resample(color, graph::Filter::bicubic, scale, output);
        return changed.mix(alone, result, mask, "masked");
    });
    masked.views["mask"] = mask;
    return masked;
}

}  // namespace clarus
