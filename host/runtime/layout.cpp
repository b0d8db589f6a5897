#include "runtime/layout.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <optional>
#include <stdexcept>
#include <utility>

#include "base/error.h"
#include "base/rounding.h"

namespace clarus::runtime {
namespace {

using graph::Graph;
using graph::Node;
using graph::Value;

// Cells start at multiples of four elements, so that a cell can be read and written in vectors of four.
constexpr int kCellAlignment = 4;
// Vector loads may run over a memory's last element by less than this many elements (kernels/common.clh).
constexpr int kSlack = 64;

Storage storage_of(const Graph& graph, Value value, Storage images) {
    const graph::Stored stored = graph::traits(graph.nodes[value].op).stored;
    return stored == graph::Stored::f32 ? Storage::f32 : stored == graph::Stored::bytes ? Storage::u8 : images;
}

bool aliases_memory(const Node& node) { return graph::aliases_memory(node.op); }

/// A use that cannot be served by a view: input `position` of `user` must be copied.
struct Conflict {
    Value user;
    int position;
};

class Placer {
  public:
    Placer(const Graph& graph, Storage images)
        : graph_(graph), images_(images), layouts_(graph.nodes.size()), states_(graph.nodes.size(), -1) {
        for (int state = 0; state < static_cast<int>(graph.states.size()); ++state) {
            int& made = states_[maker(graph.states[state].next)];
            if (made >= 0) throw std::logic_error("a memory holds one state");
            made = state;
        }
    }

    /// Lays out everything, or returns the first conflict.
    std::optional<Conflict> place() {
        check_readers();
        // Backwards, because the user of a value says where it wants it.
        for (Value value = static_cast<Value>(graph_.nodes.size()) - 1; value >= 0; --value) {
            if (aliases_memory(graph_.nodes[value])) continue;
            if (layouts_[value].memory < 0) layouts_[value] = own_memory(value);
            if (const auto conflict = place_inputs(value)) return conflict;
        }
        for (Value value = 0; value < static_cast<Value>(graph_.nodes.size()); ++value) place_view(value);
        return std::nullopt;
    }

    /// Nobody could tell samples from zeros, or from tiles, once the frame is over.
    void check_readers() const {
        const auto check = [&](Value value) {
            if (graph::stored_pixels(graph_, value) != graph::Pixels::all)
                throw std::logic_error("the output and views are stored whole");
        };
        for (const Value value : graph_.results()) check(value);
    }

    LayoutPlan plan() && { return {graph_, std::move(layouts_), std::move(memories_)}; }

  private:
    TensorLayout own_memory(Value value) {
        const graph::Shape& shape = graph_.shape(value);
        const Storage storage = storage_of(graph_, value, images_);
        const int stride = round_up(shape.channels, kCellAlignment);
        const TensorLayout layout{
            static_cast<int>(memories_.size()), storage, shape.width, shape.height, shape.channels, 1, stride, 0};
        memories_.push_back(
            {memory_bytes(layout), shape.elements() * bytes_of(storage), states_[value], false, is_handed_in(value)});
        return layout;
    }

    std::optional<Conflict> place_inputs(Value value) {
        const Node& node = graph_.nodes[value];
        const graph::Traits traits = graph::traits(node.op);
        for (int position = 0; position < static_cast<int>(node.inputs.size()); ++position)
            if (graph::stored_pixels(graph_, node.inputs[position]) > traits.reads) return Conflict{value, position};
        if (traits.memory == graph::Memory::gathers) return place_parts(value, traits.placement);
        if (traits.memory == graph::Memory::in_place &&
            (is_needed_after(node.inputs[0], value) || !try_place(node.inputs[0], layouts_[value])))
            return Conflict{value, 0};
        return std::nullopt;
    }

    /// Whether it has memory of its own that is not the plan's.
    bool is_handed_in(Value value) const {
        return graph::traits(graph_.nodes[value].op).memory == graph::Memory::imported ||
               std::find(graph_.exports.begin(), graph_.exports.end(), value) != graph_.exports.end();
    }

    /// The inputs become parts of its memory, one after the other along channels.
    std::optional<Conflict> place_parts(Value value, const graph::Placement& placement) {
        const Node& node = graph_.nodes[value];
        const TensorLayout& home = layouts_[value];
        if (placement.block > 1 && home.block > 1) return Conflict{value, 0};
        int first = 0;
        for (int position = 0; position < static_cast<int>(node.inputs.size()); ++position) {
            const graph::Shape& shape = graph_.shape(node.inputs[position]);
            TensorLayout part = home;
            part.width = shape.width;
            part.height = shape.height;
            part.channels = shape.channels;
            part.block *= placement.block;
            part.offset += first * home.block * home.block;
            if (!try_place(node.inputs[position], part)) return Conflict{value, position};
            first += part.channels;
        }
        return std::nullopt;
    }

    /// Whether the value must still be there when `user` has run; one that is shown elsewhere may be.
    bool is_needed_after(Value value, Value user) const {
        for (Value other = 0; other < static_cast<Value>(graph_.nodes.size()); ++other) {
            const Node& node = graph_.nodes[other];
            const bool reads = std::find(node.inputs.begin(), node.inputs.end(), value) != node.inputs.end();
            if (reads && (other > user || aliases_memory(node))) return true;
        }
        const std::vector<Value> results = graph_.results();
        return std::find(results.begin(), results.end(), value) != results.end() ||
               std::any_of(graph_.states.begin(), graph_.states.end(),
                           [value](const graph::State& state) { return state.next == value; });
    }

    bool try_place(Value value, const TensorLayout& layout) {
        const Node& node = graph_.nodes[value];
        const bool free = layouts_[value].memory < 0 && !aliases_memory(node) && !is_handed_in(value);
        const bool convertible = storage_of(graph_, value, images_) == layout.storage;
        // Kernels for a history of samples are several times as fast on pixels that are four elements apart than on
        // those of cells: a copy into cells costs less.
        const bool writable = std::holds_alternative<graph::Collect>(node.op)
                                  ? layout.stride == kCellAlignment
                                  : layout.block == 1 || !std::holds_alternative<graph::Convolution>(node.op);
        int& state = memories_[layout.memory].state;
        // A state has a second memory to change places with.
        const bool alone = states_[value] < 0 || (state < 0 && !memories_[layout.memory].handed_in);
        if (!free || !convertible || !writable || !alone) return false;
        if (state < 0) state = states_[value];
        layouts_[value] = layout;
        return true;
    }

    /// What writes the memory that a value shows.
    Value maker(Value value) const {
        while (aliases_memory(graph_.nodes[value])) {
            if (graph_.nodes[value].inputs.empty()) throw std::logic_error("a state is made by a kernel");
            value = graph_.nodes[value].inputs[0];
        }
        return value;
    }

    const graph::State& state_of(Value previous) const {
        return *std::find_if(graph_.states.begin(), graph_.states.end(),
                             [&](const graph::State& state) { return state.previous == previous; });
    }

    TensorLayout previous_layout(Value value) {
        const graph::State& state = state_of(value);
        TensorLayout layout = place_view(state.next);
        const int index = static_cast<int>(&state - graph_.states.data());
        memories_.push_back({memories_[layout.memory].bytes, memories_[layout.memory].values, index, true, false});
        layout.memory = static_cast<int>(memories_.size()) - 1;
        layout.previous_samples = layout.samples > 1;
        return layout;
    }

    const TensorLayout& place_view(Value value) {
        TensorLayout& layout = layouts_[value];
        if (layout.memory >= 0) return layout;
        const Node& node = graph_.nodes[value];
        const graph::Shape& shape = graph_.shape(value);
        const graph::Traits traits = graph::traits(node.op);
        layout = traits.memory == graph::Memory::previous ? previous_layout(value) : place_view(node.inputs[0]);
        layout.width = shape.width;
        layout.height = shape.height;
        layout.channels = shape.channels;
        const graph::Placement& placement = traits.placement;
        if (layout.block > 1 && (placement.block > 1 || placement.pixels != graph::Pixels::all))
            throw std::logic_error(node.name + " of blocks");
        layout.offset += placement.channel * layout.block * layout.block;
        layout.block *= placement.block;
        if (placement.pixels != graph::Pixels::all) {
            layout.samples = placement.scale;
            layout.tiled = placement.pixels == graph::Pixels::tiles;
            const auto* import = std::get_if<graph::Import>(&graph_.nodes[maker(value)].op);
            layout.previous_samples = import && import->frames_ago > 0;
        }
        return layout;
    }

    const Graph& graph_;
    Storage images_;
    std::vector<TensorLayout> layouts_;
    std::vector<int> states_;  // which of them each value makes, or −1
    std::vector<Memory> memories_;
};

/// The graph with an identity program before input `position` of `user`.
Graph with_copy(const Graph& graph, const Conflict& conflict) {
    Graph result = graph;
    result.nodes.clear();
    const auto renamed = [&](Value value) { return value >= conflict.user ? value + 1 : value; };
    for (Value value = 0; value < static_cast<Value>(graph.nodes.size()); ++value) {
        Node node = graph.nodes[value];
        for (Value& input : node.inputs) input = renamed(input);
        if (value == conflict.user) {
            const Value source = node.inputs[conflict.position];
            result.nodes.push_back({graph::Pointwise{{}, {0}}, {source}, graph.shape(source), "copy"});
            node.inputs[conflict.position] = value;
        }
        result.nodes.push_back(std::move(node));
    }
    result.rename_results(renamed);
    return result;
}

}  // namespace

size_t memory_bytes(const TensorLayout& layout) {
    return (static_cast<size_t>(layout.rows()) * layout.row() + kSlack) * bytes_of(layout.storage);
}

void check_sizes(const LayoutPlan& plan) {
    for (const TensorLayout& layout : plan.layouts)
        if (memory_bytes(layout) / bytes_of(layout.storage) > std::numeric_limits<int>::max())
            fail(ErrorKind::invalid_argument,
                 "{} channels of {}x{} pixels are more than a kernel can count; take a smaller size", layout.channels,
                 layout.width, layout.height);
}

TensorArgument argument_for(const TensorLayout& layout) {
    // Exact while a row's number times the ring is below 2^32, as the rows of any image that fits in memory are.
    const int ring = layout.in_ring ? layout.rows() : 0;
    const std::uint64_t reciprocal = ring > 1 ? (std::uint64_t{1} << 32) / ring + 1 : 0;
    return {layout.width, layout.height, layout.row(), layout.offset, ring, static_cast<std::uint32_t>(reciprocal)};
}

std::string text_of(const TensorLayout& layout) {
    const char* storage = layout.storage == Storage::u8 ? "u8" : layout.storage == Storage::f16 ? "f16" : "f32";
    return fmt::format("{}x{}x{} {} (block {}, stride {}, offset {}, samples {}{}{}, ring {}{})", layout.width,
                       layout.height, layout.channels, storage, layout.block, layout.stride, layout.offset,
                       layout.samples, layout.tiled ? " tiled" : "", layout.previous_samples ? " previous" : "",
                       layout.ring, layout.in_ring ? " rows" : "");
}

std::string layout_options(const std::string& name, const TensorLayout& layout) {
    return fmt::format(
        "-D{0}_WIDTH=sizes->{0}.width -D{0}_HEIGHT=sizes->{0}.height -D{0}_ROW=sizes->{0}.row "
        "-D{0}_OFFSET=sizes->{0}.offset -D{0}_KEPT={4} -D{0}_CHANNELS={1} -D{0}_BLOCK={2} -D{0}_STRIDE={3}",
        name, layout.channels, layout.block, layout.stride, layout.in_ring ? "RING_OF_ROWS" : "ALL_ROWS");
}

LayoutPlan lay_out(const graph::Graph& graph, Storage storage) {
    Graph current = graph;
    for (;;) {
        Placer placer(current, storage);
        const auto conflict = placer.place();
        if (!conflict) return std::move(placer).plan();
        current = with_copy(current, *conflict);
    }
}

}  // namespace clarus::runtime
