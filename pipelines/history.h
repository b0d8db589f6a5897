#pragma once

#include "graph/graph.h"
#include "io/safetensors.h"

namespace clarus::pipelines {

/// What a model asks for beyond its paper (docs/history.md, "Checked history and held range").
struct HistoryOptions {
    bool checked = false;  // metadata `history`
    bool held = false;     // metadata `range`
};

/// Errors: file, naming the key and the values that are known.
HistoryOptions history_options(const io::Safetensors& model);

/// Where a frame's history is.
struct CheckedHistory {
    graph::Value checked;  // motion of render pixels, NaN where there is none
    graph::Value motion;   // of output pixels, in output pixels, likewise
};

/// By `reproject`, to an output `scale` times as large, of what `checked_motion` leaves of motion.
CheckedHistory checked_history(graph::Graph& graph, graph::Value motion, graph::Value depth, double scale, Size output);

/// What `fsr2` has collected, as a state of the graph (docs/fsr2.md): colour and weight at output resolution, 4
/// channels.
struct CollectedHistory {
    graph::Value trust;      // how far that is believed, at render resolution; Graph::history_trust
    graph::Value collected;  // with this frame's samples
};

/// fsr2's steps 1 to 4, and the views `motion`, `past`, `past_weight`, `trust`, `weight`.
CollectedHistory collected_history(graph::Graph& graph, graph::Value color, graph::Value depth, graph::Value motion,
                                   double scale, Size output);

}  // namespace clarus::pipelines
