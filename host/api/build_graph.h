#pragma once

#include "clarus/model.h"
#include "clarus/types.h"
#include "clarus/upscaler.h"
#include "graph/graph.h"

namespace clarus {

/// Output resolution of a render resolution, sides rounded to the nearest. Errors: invalid_argument where either is not
/// from 1 to 2^15 on a side.
Size output_size(Size render, double scale);

/// What the model computes at this size. Errors: invalid_argument, naming the model and the pipeline's option that it
/// does not have or that is out of range.
graph::Graph build_graph(const Model& model, Size render, Size output, const UpscalerOptions& options = {});

}  // namespace clarus
