#pragma once

#include "clarus/stream.h"
#include "graph/graph.h"
#include "runtime/plan.h"

namespace clarus {

/// Errors: invalid_argument, naming the option.
void check_options(const runtime::PlanOptions& options, const graph::Graph& graph);

/// What frames must bring beside colour.
struct Needs {
    bool depth, motion, opaque_color;
};

/// What sizes a frame's images must have: colour; depth and motion (`render`); the output.
struct FrameSizes {
    Size color, render, output;
};

/// Errors: invalid_argument, naming the field of the frame description. Buffers must be of `context` and large enough;
/// without one there must be none.
void check_frame(const FrameDescription& frame, const StreamOptions& options, const FrameSizes& sizes, Needs needs,
                 cl_context context);

/// One coordinate of q, the sample position (docs/conventions.md, "Jitter").
int sample_position(double jitter, int scale);

}  // namespace clarus
