#pragma once

#include <vector>

#include "api/frame_checks.h"
#include "cl/context.h"
#include "graph/graph.h"
#include "runtime/frame_constants.h"
#include "runtime/plan.h"

namespace clarus {

/// PlacementCosts::seconds of a fused graph on one device: the least of a few frames of flat images. Compiles and
/// allocates what the whole network needs there. Errors: build, out_of_memory, device.
std::vector<double> measure_nodes(ocl::Context& context, const graph::Graph& fused, runtime::PlanOptions options,
                                  const FrameSizes& sizes, const runtime::FrameConstants& constants);

/// How long a device waits for what another has made.
struct TransferTime {
    double start = 0;  // seconds, whatever the size
    double a_byte = 0;
};
/// Measures it: two events where both see the same memory, else copies of two sizes. Errors: device.
TransferTime measure_transfer(ocl::Context& from, ocl::Context& to);

}  // namespace clarus
