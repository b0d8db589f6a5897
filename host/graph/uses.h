#pragma once

#include <vector>

#include "graph/graph.h"

namespace clarus::graph {

/// How often each value is used.
struct Uses {
    explicit Uses(const Graph& graph);
    bool only_one(Value value) const { return by_nodes[value] + by_others[value] == 1; }

    std::vector<int> by_nodes;
    std::vector<int> by_others;  // Graph::results and states
};

}  // namespace clarus::graph
