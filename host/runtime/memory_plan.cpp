#include "runtime/memory_plan.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <random>
#include <utility>

namespace clarus::runtime {
namespace {

using graph::Value;

/// A span of moments in a frame, both ends included. Moment n + 1 is when node n runs; inputs are written at moment 0.
struct Span {
    int first = std::numeric_limits<int>::max();
    int last = -1;

    void include(int moment) {
        first = std::min(first, moment);
        last = std::max(last, moment);
    }
    bool overlaps(const Span& other) const { return first <= other.last && other.first <= last; }
};

/// Bytes with the spans in which they are needed, and the memories that they serve.
struct Block {
    size_t bytes = 0, values = 0;  // with and without padding
    std::vector<Span> spans;
    std::vector<int> memories;
    size_t offset = 0;

    bool conflicts(const Block& other) const {
        return std::any_of(spans.begin(), spans.end(), [&](const Span& mine) {
            return std::any_of(other.spans.begin(), other.spans.end(),
                               [&](const Span& its) { return mine.overlaps(its); });
        });
    }
};

std::vector<Span> lifetimes(const LayoutPlan& plan, const std::vector<BandedNodes>& banded) {
    const graph::Graph& graph = plan.graph;
    const int end = static_cast<int>(graph.nodes.size()) + 1;
    std::vector<Span> spans(plan.memories.size());
    const auto touch = [&](Value value, int moment) { spans[plan.layouts[value].memory].include(moment); };

    const auto moment_of = [&](Value value) {
        for (const BandedNodes& nodes : banded)
            if (value >= nodes.first && value <= nodes.last) return nodes.last + 1;
        return value + 1;
    };

    for (Value value = 0; value < static_cast<Value>(graph.nodes.size()); ++value) {
        const graph::Node& node = graph.nodes[value];
        if (graph::is_view(node.op)) continue;
        const graph::Memory memory = graph::traits(node.op).memory;
        const bool is_there = memory == graph::Memory::ingested || memory == graph::Memory::imported;
        touch(value, is_there ? 0 : moment_of(value));
        for (const Value input : node.inputs) touch(input, moment_of(value));
    }
    for (const Value value : graph.results()) touch(value, end);
    for (const graph::State& state : graph.states) {
        touch(state.previous, 0);
        touch(state.next, end);
    }
    return spans;
}

std::vector<Block> make_blocks(const LayoutPlan& plan, const std::vector<Span>& spans, std::vector<bool>& alternates) {
    std::vector<Block> blocks;
    for (int memory = 0; memory < static_cast<int>(plan.memories.size()); ++memory)
        if (const Memory& each = plan.memories[memory]; each.state < 0 && !each.handed_in)
            blocks.push_back({each.bytes, each.values, {spans[memory]}, {memory}});

    for (const graph::State& state : plan.graph.states) {
        const int previous = plan.layouts[state.previous].memory;
        const int next = plan.layouts[state.next].memory;
        const auto [bytes, values] = std::pair(plan.memories[next].bytes, plan.memories[next].values);
        const bool alternate = spans[previous].overlaps(spans[next]);
        alternates.push_back(alternate);
        if (alternate) {
            // Each is last frame's value in one frame and this frame's in the next.
            blocks.push_back({bytes, values, {spans[previous], spans[next]}, {previous}});
            blocks.push_back({bytes, values, {spans[previous], spans[next]}, {next}});
        } else {
            blocks.push_back({bytes, values, {spans[previous], spans[next]}, {previous, next}});
        }
    }
    return blocks;
}

/// In this order, each at the lowest offset where it meets nothing that is needed at the same time.
size_t place(std::vector<Block>& blocks, const std::vector<int>& order) {
    std::vector<const Block*> placed;  // by offset
    size_t arena = 0;
    for (const int index : order) {
        Block& block = blocks[index];
        size_t offset = 0;
        for (const Block* other : placed) {
            if (!block.conflicts(*other)) continue;
            if (offset + block.bytes <= other->offset) break;
            offset = std::max(offset, other->offset + other->bytes);
        }
        block.offset = offset;
        arena = std::max(arena, offset + block.bytes);
        placed.insert(std::upper_bound(placed.begin(), placed.end(), &block,
                                       [](const Block* a, const Block* b) { return a->offset < b->offset; }),
                      &block);
    }
    return arena;
}

/// The largest first; where that leaves gaps, in the best of orders in which two at a time have changed places.
size_t place(std::vector<Block>& blocks, size_t least) {
    constexpr int kTries = 500;
    std::vector<int> order(blocks.size());
    std::iota(order.begin(), order.end(), 0);
    std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return blocks[a].bytes > blocks[b].bytes; });
    size_t best = place(blocks, order);
    std::mt19937 random;  // the same plan every time
    for (int tries = 0; tries < kTries && best > least; ++tries) {
        std::vector<int> other = order;
        std::swap(other[random() % other.size()], other[random() % other.size()]);
        const size_t bytes = place(blocks, other);
        if (bytes > best) continue;
        best = bytes;
        order = std::move(other);
    }
    return place(blocks, order);
}

size_t peak_live_bytes(const std::vector<Block>& blocks, int moments, size_t Block::*bytes) {
    size_t most = 0;
    for (int moment = 0; moment <= moments; ++moment) {
        const Span now{moment, moment};
        size_t live = 0;
        for (const Block& block : blocks)
            if (std::any_of(block.spans.begin(), block.spans.end(),
                            [&](const Span& span) { return span.overlaps(now); }))
                live += block.*bytes;
        most = std::max(most, live);
    }
    return most;
}

}  // namespace

MemoryPlan plan_memory(const LayoutPlan& plan, size_t alignment, const std::vector<BandedNodes>& banded) {
    MemoryPlan result;
    std::vector<Block> blocks = make_blocks(plan, lifetimes(plan, banded), result.alternates);
    const int moments = static_cast<int>(plan.graph.nodes.size()) + 1;
    result.peak_live_bytes = peak_live_bytes(blocks, moments, &Block::values);
    for (Block& block : blocks) block.bytes = (block.bytes + alignment - 1) / alignment * alignment;
    result.bytes = place(blocks, peak_live_bytes(blocks, moments, &Block::bytes));
    for (const Memory& memory : plan.memories) result.places.push_back({0, memory.bytes});
    for (const Block& block : blocks)
        for (const int memory : block.memories) result.places[memory].offset = block.offset;
    return result;
}

}  // namespace clarus::runtime
