#include "graph/partition.h"

#include <algorithm>
#include <compare>
#include <map>
#include <optional>
#include <set>
#include <utility>

namespace clarus::graph {
namespace {

/// Whether a kernel of this frame makes each node's value, or some of what it gathers.
std::vector<bool> made_nodes(const Graph& graph) {
    std::vector<bool> made;
    for (const Node& node : graph.nodes) {
        const Memory memory = traits(node.op).memory;
        const bool gathers_made = memory == Memory::gathers && std::any_of(node.inputs.begin(), node.inputs.end(),
                                                                           [&](Value input) { return made[input]; });
        made.push_back(memory == Memory::own || memory == Memory::in_place || gathers_made);
    }
    return made;
}

const State& state_of(const Graph& graph, Value previous) {
    return *std::find_if(graph.states.begin(), graph.states.end(),
                         [&](const State& state) { return state.previous == previous; });
}

/// Which part makes what.
class Numbering {
  public:
    Numbering(const Graph& graph, const std::vector<int>& places) : graph_(graph), made_(made_nodes(graph)) {
        number_parts(places);
    }

    bool is_made(Value value) const { return made_[value]; }
    /// −1 of what no kernel makes.
    const std::vector<int>& part_of() const { return part_of_; }
    const std::vector<int>& places() const { return part_places_; }

    /// What writes the memory that a value is in; −1 where no kernel of this frame does.
    Value maker_of(Value value) const {
        while (!made_[value]) {
            if (!aliases_memory(graph_.nodes[value].op) || graph_.nodes[value].inputs.empty()) return -1;
            value = graph_.nodes[value].inputs[0];
        }
        return value;
    }

    /// The part that a result of the graph belongs to: of what no kernel makes, the first.
    int part_of_result(Value value) const {
        const Value maker = maker_of(value);
        return maker < 0 ? 0 : part_of_[maker];
    }

    /// The Previous nodes of states that are read elsewhere than where they are made, in the frame after or in the
    /// same. Of a state that is made of the frame's inputs alone, every part keeps its own.
    std::set<Value> crossing_states() const {
        std::set<Value> crossing;
        for (const auto& [previous, next] : graph_.states) {
            const Value maker = maker_of(next);
            if (maker < 0) continue;
            std::set<int> parts = readers(previous);
            parts.merge(readers(maker));
            if (std::any_of(parts.begin(), parts.end(), [&](int part) { return part != part_of_[maker]; }))
                crossing.insert(previous);
        }
        return crossing;
    }

  private:
    Value size() const { return static_cast<Value>(graph_.nodes.size()); }

    /// A part is what has the same place, and as many changes of place before it: no path leaves it and comes back.
    void number_parts(const std::vector<int>& places) {
        std::vector<int> changes(graph_.nodes.size(), 0);
        std::map<std::pair<int, int>, int> parts;
        for (Value value = 0; value < size(); ++value) {
            if (!made_[value]) continue;
            for (const Value input : graph_.nodes[value].inputs)
                if (const Value source = maker_of(input); source >= 0)
                    changes[value] = std::max(changes[value], changes[source] + (places[source] != places[value]));
            parts[{changes[value], places[value]}] = -1;
        }
        for (auto& [key, part] : parts) {
            part = static_cast<int>(part_places_.size());
            part_places_.push_back(key.second);
        }
        if (parts.empty()) part_places_.push_back(0);
        for (Value value = 0; value < size(); ++value)
            part_of_.push_back(made_[value] ? parts.at({changes[value], places[value]}) : -1);
    }

    /// The parts that read a value, through views.
    std::set<int> readers(Value value) const {
        std::set<int> parts;
        for (Value user = 0; user < size(); ++user) {
            const std::vector<Value>& inputs = graph_.nodes[user].inputs;
            if (std::find(inputs.begin(), inputs.end(), value) == inputs.end()) continue;
            if (made_[user])
                parts.insert(part_of_[user]);
            else
                parts.merge(readers(user));
        }
        for (const Value result : graph_.results())
            if (result == value) parts.insert(part_of_result(value));
        return parts;
    }

    const Graph& graph_;
    const std::vector<bool> made_;
    std::vector<int> part_of_;
    std::vector<int> part_places_;
};

/// A value of the whole graph that a part imports, in the order of its ports.
struct Wanted {
    Value value;
    int frames_ago;
    friend auto operator<=>(const Wanted&, const Wanted&) = default;
};

/// Takes over into a part's graph what it needs of the whole.
class Extraction {
  public:
    Extraction(const Graph& whole, const Numbering& numbering, const std::set<Value>& crossing, int part)
        : whole_(whole), numbering_(numbering), crossing_(crossing), part_(part), taken_(whole.nodes.size(), -1) {
        graph.parameters = whole.parameters;
        for (Value value = 0; value < static_cast<Value>(whole.nodes.size()); ++value)
            if (numbering.part_of()[value] == part) take(value);
        for (const auto& [name, value] : whole.views)
            if (numbering.part_of_result(value) == part) graph.views[name] = take(value);
        for (const std::string& name : whole.views_by_channel)
            if (graph.views.contains(name)) graph.views_by_channel.insert(name);
        if (whole.output >= 0 && numbering.part_of_result(whole.output) == part) graph.output = take(whole.output);
        take_states();
        if (is_conditioned()) graph.jitter_kernels = whole.jitter_kernels;
    }

    /// The port of a value that another part reads, where that is told as numbers.
    int port_of(Value value, const std::optional<Quantization>& numbers) {
        const Value exported = numbers ? in_numbers(taken_[value], *numbers) : taken_[value];
        const auto found = std::find(graph.exports.begin(), graph.exports.end(), exported);
        const auto port = static_cast<int>(found - graph.exports.begin());
        if (found == graph.exports.end()) graph.exports.push_back(exported);
        return port;
    }

    /// What all that read an import round it to, where it is not stored so. Of what comes from the frame before there
    /// may be none yet, and zeros are no numbers.
    std::optional<Quantization> numbers_of(int port) const {
        const Value imported = imports_.at(wanted[port]);
        std::optional<Quantization> numbers;
        if (wanted[port].frames_ago > 0 || std::get<Import>(graph.nodes[imported].op).stored == Stored::bytes)
            return numbers;
        for (const Node& node : graph.nodes) {
            if (std::find(node.inputs.begin(), node.inputs.end(), imported) == node.inputs.end()) continue;
            const auto* convolution = std::get_if<Convolution>(&node.op);
            if (!convolution || !convolution->rounds || !convolution->readings.empty() ||
                (numbers && *numbers != *convolution->rounds))
                return std::nullopt;
            numbers = convolution->rounds;
        }
        return numbers;
    }
    void import_as_bytes(int port) {
        std::get<Import>(graph.nodes[imports_.at(wanted[port])].op).stored = Stored::bytes;
    }

    /// Of the whole graph: what the part takes of the frame.
    std::vector<Value> read() const {
        std::vector<Value> read;
        for (Value value = 0; value < static_cast<Value>(taken_.size()); ++value)
            if (taken_[value] >= 0 && traits(whole_.nodes[value].op).memory == Memory::ingested) read.push_back(value);
        return read;
    }

    Graph graph;
    std::vector<Wanted> wanted;

  private:
    Value take(Value value) {
        if (taken_[value] >= 0) return taken_[value];
        if (numbering_.is_made(value) && numbering_.part_of()[value] != part_)
            taken_[value] = import(value, 0);
        else if (crossing_.contains(value))
            taken_[value] = take_past(state_of(whole_, value).next);
        else
            taken_[value] = add(value, [this](Value input) { return take(input); });
        return taken_[value];
    }

    /// A value as the frame before made it.
    Value take_past(Value value) {
        if (numbering_.is_made(value)) return import(value, 1);
        return add(value, [this](Value input) { return take_past(input); });
    }

    template <typename Take>
    Value add(Value value, Take&& take) {
        Node node = whole_.nodes[value];
        for (Value& input : node.inputs) input = take(input);
        graph.nodes.push_back(std::move(node));
        return static_cast<Value>(graph.nodes.size()) - 1;
    }

    Value import(Value value, int frames_ago) {
        const auto known = imports_.find({value, frames_ago});
        if (known != imports_.end()) return known->second;
        const Node& node = whole_.nodes[value];
        const Stored stored = traits(node.op).stored;
        const int port = static_cast<int>(wanted.size());
        wanted.push_back({value, frames_ago});
        graph.nodes.push_back(
            {Import{port, frames_ago, stored == Stored::as_input ? Stored::image : stored}, {}, node.shape, node.name});
        return imports_[{value, frames_ago}] = static_cast<Value>(graph.nodes.size()) - 1;
    }

    /// Of what was taken. What a state becomes may be made of another's view, which is then taken, too.
    void take_states() {
        for (bool added = true; std::exchange(added, false);)
            for (const auto& [previous, next] : whole_.states) {
                const auto is_it = [&](const State& state) { return state.previous == taken_[previous]; };
                if (taken_[previous] < 0 || crossing_.contains(previous) ||
                    std::any_of(graph.states.begin(), graph.states.end(), is_it))
                    continue;
                graph.carry(taken_[previous], in_own_memory(take(next)));
                added = true;
            }
    }

    /// A copy where the value is in memory that another part writes again.
    Value in_own_memory(Value value) {
        if (!std::holds_alternative<Import>(graph.nodes[maker_of_memory(graph, value)].op)) return value;
        graph.nodes.push_back({Pointwise{{}, {0}}, {value}, graph.shape(value), "copy"});
        return static_cast<Value>(graph.nodes.size()) - 1;
    }

    /// The node that rounds a value, made where there is none.
    Value in_numbers(Value value, const Quantization& quantization) {
        const auto is_it = [&](const Node& node) {
            const auto* numbers = std::get_if<Numbers>(&node.op);
            return numbers && numbers->quantization == quantization && node.inputs[0] == value;
        };
        const auto found = std::find_if(graph.nodes.begin(), graph.nodes.end(), is_it);
        if (found != graph.nodes.end()) return static_cast<Value>(found - graph.nodes.begin());
        const std::string name = graph.nodes[value].name + " in bytes";
        graph.nodes.push_back({Numbers{quantization}, {value}, graph.shape(value), name});
        return static_cast<Value>(graph.nodes.size()) - 1;
    }

    bool is_conditioned() const {
        return std::any_of(graph.nodes.begin(), graph.nodes.end(), [&](const Node& node) {
            const auto* convolution = std::get_if<Convolution>(&node.op);
            return convolution && graph.parameters[convolution->parameters]->conditioned;
        });
    }

    const Graph& whole_;
    const Numbering& numbering_;
    const std::set<Value>& crossing_;
    const int part_;
    std::vector<Value> taken_;  // by the whole graph's value, −1 where it is not
    std::map<Wanted, Value> imports_;
};

}  // namespace

Value maker_of_memory(const Graph& graph, Value value) {
    while (aliases_memory(graph.nodes[value].op) && !graph.nodes[value].inputs.empty())
        value = graph.nodes[value].inputs[0];
    return value;
}

std::vector<int> part_of_nodes(const Graph& graph, const std::vector<int>& places) {
    return Numbering(graph, places).part_of();
}

Partition partition(const Graph& graph, const std::vector<int>& places,
                    const std::function<bool(int from, int to)>& copied) {
    const Numbering numbering(graph, places);
    const std::set<Value> crossing = numbering.crossing_states();
    const int count = static_cast<int>(numbering.places().size());
    std::vector<Extraction> extractions;
    extractions.reserve(count);
    for (int part = 0; part < count; ++part) extractions.emplace_back(graph, numbering, crossing, part);

    const auto is_copied = [&](Value value, int to) {
        return copied && copied(numbering.places()[numbering.part_of()[value]], numbering.places()[to]);
    };
    // What each value is copied as: as numbers where all that read a copy agree, lest it be copied in two forms.
    std::map<Value, std::optional<Quantization>> numbers;
    for (int to = 0; to < count; ++to)
        for (int port = 0; port < static_cast<int>(extractions[to].wanted.size()); ++port) {
            const Value value = extractions[to].wanted[port].value;
            if (!is_copied(value, to)) continue;
            const std::optional<Quantization> wish = extractions[to].numbers_of(port);
            const auto [known, is_first] = numbers.try_emplace(value, wish);
            if (!is_first && known->second != wish) known->second.reset();
        }

    Partition result;
    for (int to = 0; to < count; ++to)
        for (int port = 0; port < static_cast<int>(extractions[to].wanted.size()); ++port) {
            const auto& [value, frames_ago] = extractions[to].wanted[port];
            const int from = numbering.part_of()[value];
            const auto as = is_copied(value, to) ? numbers.at(value) : std::nullopt;
            if (as) extractions[to].import_as_bytes(port);
            result.links.push_back({from, extractions[from].port_of(value, as), to, port, frames_ago});
        }
    for (int part = 0; part < count; ++part)
        result.parts.push_back(
            {numbering.places()[part], std::move(extractions[part].graph), extractions[part].read()});
    return result;
}

}  // namespace clarus::graph
