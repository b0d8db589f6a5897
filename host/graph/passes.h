#pragma once

#include <functional>

#include "graph/graph.h"

namespace clarus::graph {

/// Each pass returns a graph that computes the same output, states and views.

/// Makes convolutions pool, upsample by two, weight and put together what they read, where that has no other use:
/// these then need no pass and no memory of their own. What is gathered in blocks at an input's end they read apart
/// from the rest, so that what makes or reads either does not step over the other. Before fuse_pointwise.
Graph fuse_convolution_inputs(const Graph& graph);

/// Has convolutions in whole numbers hand on their results as bytes where nothing else than such convolutions reads
/// them, all of which round what they read to the same numbers. What is computed is defined by the graph after it
/// (docs/quantization.md). Before fuse_convolution_inputs.
Graph hand_on_bytes(const Graph& graph);

/// Joins pointwise programs: into their users where they have one user only, which may be several that have been joined
/// before, and through concat, so that one program writes all channels of the joined image. What would have had to be
/// copied into a concat is then computed in place, and what it takes from the memory of others (slices, zero-upsampled
/// images) is gathered in one go.
Graph fuse_pointwise(const Graph& graph);

/// Drops nodes and parameters that neither output, states nor the views named in `keep` need; other views are
/// forgotten.
Graph remove_unused(const Graph& graph, const std::vector<std::string>& keep);
/// The same, keeping all views.
Graph remove_unused(const Graph& graph);

/// All of these, in their order.
Graph fuse(const Graph& graph, const std::vector<std::string>& keep);

/// A graph in which what `change` makes of a value stands in the value's place. What comes before it keeps its number.
Graph with_changed(const Graph& graph, Value value, const std::function<Value(Graph&, Value)>& change);
/// The node that hands out a resource; −1 where nothing reads it.
Value input_of(const Graph& graph, Resource resource);

}  // namespace clarus::graph
