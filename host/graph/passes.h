#pragma once

#include <functional>

#include "graph/graph.h"

namespace clarus::graph {

/// Each pass returns a graph that computes the same output, states and views.

/// Joins pointwise programs: into their users where they have one user only, and through concat, so that one program
/// writes all channels of the joined image. What would have had to be copied into a concat is then computed in place,
/// and what it takes from the memory of others (slices, zero-upsampled images) is gathered in one go.
Graph fuse_pointwise(const Graph& graph);

/// Drops nodes and parameters that neither output, states nor the views named in `keep` need; other views are
/// forgotten.
Graph remove_unused(const Graph& graph, const std::vector<std::string>& keep);

/// A graph in which what `change` adds to the colour input stands in the input's place.
Graph with_changed_color(const Graph& graph, const std::function<Value(Graph&, Value color)>& change);

}  // namespace clarus::graph
