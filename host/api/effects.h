#pragma once

#include "clarus/upscaler.h"
#include "graph/graph.h"

namespace clarus {

/// The graph with what the options ask for before and after a model: antialiasing of its colour input, antialiasing of
/// what it shows, which is then resampled to size `shown` where it has another (shown_size), and sharpened. Its states
/// and views, but that of the input, are as they were.
graph::Graph with_effects(const graph::Graph& graph, Size shown, const UpscalerOptions& options);

}  // namespace clarus
