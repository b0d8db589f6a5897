#include "graph/uses.h"

namespace clarus::graph {

Uses::Uses(const Graph& graph) : by_nodes(graph.nodes.size()), by_others(graph.nodes.size()) {
    for (const Node& node : graph.nodes)
        for (const Value input : node.inputs) ++by_nodes[input];
    for (const State& state : graph.states) ++by_others[state.next];
    for (const Value value : graph.results()) ++by_others[value];
}

}  // namespace clarus::graph
