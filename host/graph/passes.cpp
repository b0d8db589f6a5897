#include "graph/passes.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "graph/uses.h"

namespace clarus::graph {
namespace {

/// Builds one pointwise program out of several. Operands are kept as `~step` for steps until the number of inputs is
/// known.
class Program {
  public:
    int add_input(Value value) {
        const auto found = std::find(inputs_.begin(), inputs_.end(), value);
        if (found != inputs_.end()) return static_cast<int>(found - inputs_.begin());
        inputs_.push_back(value);
        return static_cast<int>(inputs_.size()) - 1;
    }

    /// Appends `program`, whose inputs are these operands, and returns the operands of its results.
    std::vector<int> append(const Pointwise& program, std::vector<int> operands) {
        for (Step step : program.steps) {
            for (int& operand : step.operands) operand = operands[operand];
            steps_.push_back(std::move(step));
            operands.push_back(~(static_cast<int>(steps_.size()) - 1));
        }
        std::vector<int> results;
        for (const int result : program.results) results.push_back(operands[result]);
        return results;
    }

    void finish(Node& node, std::vector<int> results) && {
        const int inputs = static_cast<int>(inputs_.size());
        const auto number = [inputs](int& operand) {
            if (operand < 0) operand = inputs + ~operand;
        };
        for (Step& step : steps_) std::for_each(step.operands.begin(), step.operands.end(), number);
        std::for_each(results.begin(), results.end(), number);
        node.op = Pointwise{std::move(steps_), std::move(results)};
        node.inputs = std::move(inputs_);
    }

  private:
    std::vector<Value> inputs_;
    std::vector<Step> steps_;
};

const Pointwise* as_pointwise(const Graph& graph, Value value) {
    return std::get_if<Pointwise>(&graph.nodes[value].op);
}

/// The operands under which `program` knows the results of `value`: those of its steps where it is a pointwise node
/// that `absorb` allows to take in, else the value as an input.
std::vector<int> take_in(Program& program, const Graph& graph, Value value, bool absorb) {
    const Pointwise* source = as_pointwise(graph, value);
    if (!absorb || !source) return {program.add_input(value)};
    std::vector<int> operands;
    for (const Value input : graph.nodes[value].inputs) operands.push_back(program.add_input(input));
    return program.append(*source, std::move(operands));
}

// Steps of one program, of which compilers take ever more time: PoCL 3.1 for 32 times tanh 1 s, for 100 times 46 s. The
// longest of any shipped model has fewer than 20. Each is there for every channel: 8 times tanh of 256 take 26 s.
constexpr size_t kLongestProgram = 32;
constexpr size_t kMostStatements = 2048;

bool is_short(size_t steps, int channels) {
    return steps <= kLongestProgram && steps * static_cast<size_t>(channels) <= kMostStatements;
}

/// Whether there was anything to join.
bool join_into_users(Graph& graph) {
    const Uses uses(graph);
    bool joined = false;
    for (Node& node : graph.nodes) {
        const auto* pointwise = std::get_if<Pointwise>(&node.op);
        if (!pointwise) continue;
        Program program;
        std::vector<int> operands;
        size_t steps = pointwise->steps.size();
        for (const Value input : node.inputs) {
            const Pointwise* source = as_pointwise(graph, input);
            const int channels = std::max(node.shape.channels, graph.shape(input).channels);
            const bool absorb = source && source->results.size() == 1 && uses.only_one(input) &&
                                is_short(steps + source->steps.size(), channels);
            if (absorb) steps += source->steps.size();
            joined = joined || absorb;
            operands.push_back(take_in(program, graph, input, absorb).front());
        }
        std::vector<int> results = program.append(*pointwise, std::move(operands));
        std::move(program).finish(node, std::move(results));
    }
    return joined;
}

void replace_outside_nodes(Graph& graph, Value from, Value to) {
    graph.rename_results([&](Value value) { return value == from ? to : value; });
}

void join_through_concat(Graph& graph) {
    const Uses uses(graph);
    const Value end = static_cast<Value>(graph.nodes.size());
    for (Value concat = 0; concat < end; ++concat) {
        if (!std::holds_alternative<Concat>(graph.nodes[concat].op)) continue;
        const std::vector<Value> parts = graph.nodes[concat].inputs;
        const auto is_export = [&](Value part) {
            return std::find(graph.exports.begin(), graph.exports.end(), part) != graph.exports.end();
        };
        size_t steps = 0;
        for (const Value part : parts)
            if (const Pointwise* source = as_pointwise(graph, part)) steps += source->steps.size();
        const auto absorbed = [&](Value part) {
            return is_short(steps, graph.shape(concat).channels) && as_pointwise(graph, part) &&
                   uses.by_nodes[part] == 1 && !is_export(part);
        };
        const auto gathered = [&](Value part) {
            const Operator& op = graph.nodes[part].op;
            return absorbed(part) || std::holds_alternative<Slice>(op) || std::holds_alternative<ZeroUpsample>(op);
        };
        if (std::none_of(parts.begin(), parts.end(), gathered)) continue;

        Program program;
        std::vector<int> results;
        for (const Value part : parts)
            for (const int operand : take_in(program, graph, part, absorbed(part))) results.push_back(operand);
        std::move(program).finish(graph.nodes[concat], std::move(results));
        if (graph.nodes[concat].name.empty()) graph.nodes[concat].name = graph.nodes[parts.front()].name;

        int first = 0;
        for (const Value part : parts) {
            const int channels = graph.shape(part).channels;
            if (absorbed(part) && uses.by_others[part] > 0)
                replace_outside_nodes(graph, part, graph.slice(concat, first, channels));
            first += channels;
        }
    }
}

}  // namespace

Graph hand_on_bytes(const Graph& graph) {
    Graph result = graph;
    const Uses uses(graph);
    std::vector<std::optional<Quantization>> read_as(graph.nodes.size());
    std::vector<int> readers(graph.nodes.size());  // that read a value as that
    for (const Node& node : graph.nodes) {
        const auto* convolution = std::get_if<Convolution>(&node.op);
        if (!convolution || !convolution->rounds) continue;
        std::optional<Quantization>& quantization = read_as[node.inputs[0]];
        if (!quantization) quantization = convolution->rounds;
        if (*quantization == *convolution->rounds) ++readers[node.inputs[0]];
    }
    for (Value value = 0; value < static_cast<Value>(graph.nodes.size()); ++value) {
        auto* convolution = std::get_if<Convolution>(&result.nodes[value].op);
        if (convolution && convolution->rounds && readers[value] > 0 && readers[value] == uses.by_nodes[value] &&
            uses.by_others[value] == 0)
            convolution->result = read_as[value];
    }
    return result;
}

Graph fuse_pointwise(const Graph& graph) {
    Graph result = graph;
    // Once several users of a value are one program, that is its only user.
    while (join_into_users(result)) result = remove_unused(result);
    join_through_concat(result);
    return remove_unused(result);
}

Graph remove_unused(const Graph& graph) {
    std::vector<std::string> views;
    for (const auto& [name, value] : graph.views) views.push_back(name);
    return remove_unused(graph, views);
}

Graph remove_unused(const Graph& graph, const std::vector<std::string>& keep) {
    std::vector<bool> needed(graph.nodes.size(), false);
    const auto need = [&](auto&& self, Value value) -> void {
        if (needed[value]) return;
        needed[value] = true;
        for (const Value input : graph.nodes[value].inputs) self(self, input);
        for (const State& state : graph.states)
            if (state.previous == value) self(self, state.next);
    };
    Graph result;
    result.output = graph.output;
    result.exports = graph.exports;
    for (const auto& [name, value] : graph.views)
        if (std::find(keep.begin(), keep.end(), name) != keep.end()) result.views[name] = value;
    for (const Value value : result.results()) need(need, value);

    result.parameters = graph.parameters;
    result.jitter_kernels = graph.jitter_kernels;
    result.views_by_channel = graph.views_by_channel;
    std::vector<Value> renamed(graph.nodes.size(), -1);
    for (Value value = 0; value < static_cast<Value>(graph.nodes.size()); ++value) {
        if (!needed[value]) continue;
        Node node = graph.nodes[value];
        for (Value& input : node.inputs) input = renamed[input];
        renamed[value] = static_cast<Value>(result.nodes.size());
        result.nodes.push_back(std::move(node));
    }
    for (const State& state : graph.states)
        if (needed[state.previous]) result.states.push_back(state);
    result.rename_results([&](Value value) { return renamed[value]; });
    return result;
}

Graph fuse(const Graph& graph, const std::vector<std::string>& keep) {
    return fuse_pointwise(fuse_convolution_inputs(hand_on_bytes(remove_unused(graph, keep))));
}

Graph with_changed(const Graph& graph, Value value, const std::function<Value(Graph&, Value)>& change) {
    Graph result = graph;
    result.nodes.clear();
    std::vector<Value> renamed;
    for (Node node : graph.nodes) {
        for (Value& input : node.inputs) input = renamed[input];
        result.nodes.push_back(std::move(node));
        const Value last = static_cast<Value>(result.nodes.size()) - 1;
        const bool is_changed = static_cast<Value>(renamed.size()) == value;
        renamed.push_back(is_changed ? change(result, last) : last);
    }
    result.rename_results([&](Value each) { return renamed[each]; });
    return result;
}

Value input_of(const Graph& graph, Resource resource) {
    for (Value value = 0; value < static_cast<Value>(graph.nodes.size()); ++value)
        if (const auto* input = std::get_if<Input>(&graph.nodes[value].op); input && input->resource == resource)
            return value;
    return -1;
}

}  // namespace clarus::graph
