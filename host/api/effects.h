#pragma once

#include "clarus/upscaler.h"
#include "graph/graph.h"

namespace clarus {

/// The graph with what the options ask for before and after a model: antialiasing of its colour input, antialiasing and
/// sharpening of what it shows. Its states and views, but that of the input, are as they were.
graph::Graph with_effects(const graph::Graph& graph, const UpscalerOptions& options);

}  // namespace clarus
