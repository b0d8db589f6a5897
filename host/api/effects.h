#pragma once

#include "clarus/upscaler.h"
#include "graph/graph.h"

namespace clarus {

/// The graph with user interface drawn over its output, where the options say that frames bring it.
graph::Graph with_ui(const graph::Graph& graph, const StreamOptions& options);

/// The graph with what the options ask for before and after a model: antialiasing of its colour input, antialiasing of
/// what it shows, which is then resampled to size `shown` where it has another (shown_size), and sharpened; user
/// interface last. Its states and views, but that of the input, are as they were.
graph::Graph with_effects(const graph::Graph& graph, Size shown, const UpscalerOptions& options);

}  // namespace clarus
