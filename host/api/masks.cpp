#include "api/masks.h"

#include <vector>

#include "graph/passes.h"

namespace clarus {

using graph::Graph;
using graph::Resource;
using graph::Value;

namespace {

// A quarter of the range between opaque colour and what is shown: nothing of what was before is taken.
constexpr float kOpaqueDifference = 0.25f;

/// How much of each pixel is transparent, from what was there before that was drawn.
Value mask_of_difference(Graph& graph, Value color, Value opaque) {
    const Value largest = graph.channel_maximum(graph.difference(color, opaque, "transparency"), 1, "transparency");
    return graph.clamp(graph.linear({largest}, {1 / kOpaqueDifference}, 0, "transparency"), 0, 1, "transparency");
}

}  // namespace

Graph with_masks(const Graph& graph, double scale, const StreamOptions& options) {
    const bool has_mask = options.reactive_format || options.transparency_format || options.opaque_format;
    const Value color = graph::input_of(graph, Resource::color);
    if (!has_mask || graph.states.empty() || color < 0) return graph;
    const graph::Shape& seen = graph.shape(color);
    const graph::Shape& made = graph.shape(graph.output);
    const Size render{seen.width, seen.height}, output{made.width, made.height};
    Value mask = -1;
    Graph masked = graph::with_changed(graph, graph.output, [&](Graph& changed, Value result) {
        std::vector<Value> masks;
        const auto add = [&](Value given) {
            masks.push_back(changed.resample(given, graph::Filter::bilinear, scale, output));
        };
        if (options.reactive_format) add(changed.input(Resource::reactive_mask, render));
        if (options.transparency_format) add(changed.input(Resource::transparency_mask, render));
        if (options.opaque_format)
            add(mask_of_difference(changed, color, changed.input(Resource::opaque_color, render)));
        mask = masks.size() == 1 ? masks[0] : changed.channel_maximum(changed.concat(masks), 1, "masks");
        const Value alone = changed.resample(color, graph::Filter::bicubic, scale, output);
        return changed.mix(alone, result, mask, "masked");
    });
    masked.views["mask"] = mask;
    return masked;
}

}  // namespace clarus
