#pragma once

#include "clarus/upscaler.h"
#include "graph/graph.h"

namespace clarus {

/// The graph with user interface drawn over its output, and over its alpha where it has that, where the options say
/// that frames bring it.
graph::Graph with_ui(const graph::Graph& graph, const StreamOptions& options);

/// The graph with what the options ask for before and after a model: antialiasing of its colour input, antialiasing of
/// what it shows, which is then resampled to size `shown` where it has another (shown_size), and sharpened. Its
/// states and views, but that of the input, are as they were.
graph::Graph with_effects(const graph::Graph& graph, Size shown, const UpscalerOptions& options);

/// How a frame's alpha becomes the output's.
struct AlphaSizes {
    Size render;
    double scale;  // by which it is upscaled to `own`, the model's size
    Size own;
    bool is_jittered;  // whether the frame's jitter is to be taken out
};
/// The graph with alpha as a fourth channel of its output (docs/integrating.md, "Alpha").
graph::Graph with_alpha(const graph::Graph& graph, const AlphaSizes& sizes);

}  // namespace clarus
