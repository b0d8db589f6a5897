#pragma once

#include "graph/graph.h"
#include "io/safetensors.h"

namespace clarus::pipelines {

/// What a model asks for beyond its paper (docs/history.md).
struct HistoryOptions {
    bool checked = false;  // metadata `history`
    bool held = false;     // metadata `range`
};

/// Errors: file, naming the key and the values that are known.
HistoryOptions history_options(const io::Safetensors& model);

/// Where a frame's history is.
struct CheckedHistory {
    graph::Value motion;    // of HR pixels, in HR pixels, NaN where there is none
    graph::Value validity;  // of render pixels: 1 where there is one
};

/// By `reproject` of what `checked_motion` leaves of motion.
CheckedHistory checked_history(graph::Graph& graph, graph::Value motion, graph::Value depth, int scale);

}  // namespace clarus::pipelines
