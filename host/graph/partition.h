#pragma once

#include <functional>
#include <vector>

#include "graph/graph.h"

namespace clarus::graph {

/// What a part of a network reads of another, or of itself a frame ago.
struct Link {
    int from = 0;        // index of the part that makes it
    int from_port = 0;   // index into its graph's `exports`
    int to = 0;          // index of the part that reads it,
    int to_port = 0;     // as Import::port
    int frames_ago = 0;  // Import::frames_ago: 0, what this frame makes; 1, what the frame before made
};

/// Nodes of a network that run on one device, one after the other, without waiting for another device in between.
struct Part {
    int place;  // which device
    Graph graph;
    std::vector<Value> read;  // of the whole graph: the frame's inputs that it reads
};

/// Parts in an order in which each comes after those whose results of the same frame it reads.
struct Partition {
    std::vector<Part> parts;
    std::vector<Link> links;
};

/// What writes the memory that a value is in: itself, or what it is a view of.
Value maker_of_memory(const Graph& graph, Value value);

/// Which part each node's value is made in; −1 where no kernel makes it. `places`: as partition's.
std::vector<int> part_of_nodes(const Graph& graph, const std::vector<int>& places);

/// Cuts a graph into parts. `places`: for each node that a kernel makes, the number of its device. What no kernel makes
/// is repeated in each part that reads it: the frame's inputs, and views of memory. States that cross a cut become
/// links to the frame before. The output, and each view, is in the part that makes it. `copied`: whether what crosses
/// from one place to another is copied; then what convolutions in whole numbers alone read crosses as their numbers.
Partition partition(const Graph& graph, const std::vector<int>& places,
                    const std::function<bool(int from, int to)>& copied = {});

}  // namespace clarus::graph
