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

/// What the masks that the options name say together, at render size.
Value add_mask(Graph& graph, Value color, Size render, const StreamOptions& options) {
    std::vector<Value> masks;
    if (options.reactive_format) masks.push_back(graph.input(Resource::reactive_mask, render));
    if (options.transparency_format) masks.push_back(graph.input(Resource::transparency_mask, render));
    if (options.opaque_format)
        masks.push_back(mask_of_difference(graph, color, graph.input(Resource::opaque_color, render)));
    return masks.size() == 1 ? masks[0] : graph.channel_maximum(graph.concat(masks), 1, "masks");
}

/// The trust where the mask is 0, none where it is 1.
Value lowered(Graph& graph, Value trust, Value mask) {
    const graph::Shape& shape = graph.shape(trust);
    const Value padded = graph.replicate_to(mask, {shape.width, shape.height});
    return graph.product(trust, graph.linear({padded}, {-1}, 1, "trust"), "trust");
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
    Graph masked = graph;
    if (graph.history_trust >= 0)
        masked = graph::with_changed(masked, masked.history_trust, [&](Graph& changed, Value trust) {
            mask = add_mask(changed, color, render, options);
            return lowered(changed, trust, mask);
        });
    // What comes before the output keeps its number.
    masked = graph::with_changed(masked, masked.output, [&](Graph& changed, Value result) {
        if (mask < 0) mask = add_mask(changed, color, render, options);
        const Value alone = changed.resample(color, graph::Filter::bicubic, scale, output);
        mask = changed.resample(mask, graph::Filter::bilinear, scale, output);
        return changed.mix(alone, result, mask, "masked");
    });
    masked.views["mask"] = mask;
    return masked;
}

}  // namespace clarus
