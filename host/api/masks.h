#pragma once

#include "clarus/upscaler.h"
#include "graph/graph.h"

namespace clarus {

/// The graph of a model with the masks that the options name (docs/integrating.md, "Masks"): where they say so, the
/// output comes from the frame's own colour alone, resampled by `scale`, and so does what is kept of the output. The
/// graph itself where they name none, or where it keeps nothing of earlier frames.
graph::Graph with_masks(const graph::Graph& graph, double scale, const StreamOptions& options);

}  // namespace clarus
