#pragma once

#include <optional>

#include "clarus/model.h"
#include "clarus/types.h"
#include "graph/graph.h"

namespace clarus {

/// Output resolution of a render resolution. Errors: invalid_argument where either is not from 1 to 2^15 on a side.
Size scaled(Size render, double scale);

/// What the model computes at this size, with no more previous frames than told. Errors: invalid_argument where it has
/// fewer, or none to choose.
graph::Graph build_graph(const Model& model, Size render, Size output, std::optional<int> previous_frames = {});

}  // namespace clarus
