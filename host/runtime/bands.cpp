#include "runtime/bands.h"

#include <algorithm>
#include <limits>
#include <optional>
#include <set>

#include "base/rounding.h"
#include "runtime/implementation.h"

namespace clarus::runtime {
namespace {

using graph::Graph;
using graph::Node;
using graph::Rows;
using graph::Value;

// Below this, and below a share of what the device gives at once, images stay whole: bands cost launches.
constexpr size_t kLarge = size_t(384) << 20;
constexpr size_t kLargeShare = 4;
constexpr int kRows = 32;

// Pixels of 4K. A model that would be run in bands at that size has its kernels compiled for rings at every size, so
// that no smaller one compiles anything else.
constexpr double kLargestOutput = 3840.0 * 2160;

size_t large_on(const DeviceProfile& profile) {
    return profile.max_allocation == 0 ? kLarge : std::min(kLarge, profile.max_allocation / kLargeShare);
}

bool launches(const Node& node) { return !implementations(node).empty(); }

bool reads_by_rows(const Node& node) { return graph::traits(node.op).rows != graph::kAnyRows; }

bool works_in_bands(const LayoutPlan& plan, Value value) {
    const Node& node = plan.graph.nodes[value];
    const auto plain = [&](Value each) { return plan.layouts[each].block == 1; };
    return reads_by_rows(node) && plain(value) && std::all_of(node.inputs.begin(), node.inputs.end(), plain);
}

class Planner {
  public:
    Planner(LayoutPlan& plan, Value first, Value last, int granule)
        : plan_(plan), graph_(plan.graph), first_(first), last_(last), granule_(granule), done_(graph_.nodes.size()) {
        find_inner_memories();
    }

    /// Has kernels compiled for rings of the rows of these images, whether there will be rings or not.
    void expect_rings() {
        for (TensorLayout& layout : plan_.layouts) layout.in_ring = layout.in_ring || inner_.contains(layout.memory);
    }

    /// Bytes of images that nobody else uses.
    size_t inner_bytes() const {
        size_t bytes = 0;
        for (const int memory : inner_) bytes += plan_.memories[memory].bytes;
        return bytes;
    }

    BandedNodes run(int rows) {
        BandedNodes result{first_, last_, {}};
        int tallest = 0;
        for (Value value = first_; value <= last_; ++value)
            if (is_stage(value)) tallest = std::max(tallest, graph_.shape(value).height);
        rows = round_up(std::min(rows, tallest), granule_);
        std::vector<int> rings(plan_.memories.size());
        for (int end = rows; end - rows < tallest; end += rows) {
            const std::vector<int> wanted = wanted_rows(static_cast<double>(end) / tallest);
            grow_rings(wanted, rings);
            for (Value value = first_; value <= last_; ++value) {
                if (!is_stage(value) || wanted[value] <= done_[value]) continue;
                result.order.push_back({value, done_[value], wanted[value]});
                done_[value] = wanted[value];
            }
        }
        lay_out_rings(rings);
        return result;
    }

  private:
    bool is_stage(Value value) const { return value >= first_ && value <= last_ && launches(graph_.nodes[value]); }

    void find_inner_memories() {
        std::set<int> outside;
        const auto use = [&](Value value, bool inside) {
            (inside ? inner_ : outside).insert(plan_.layouts[value].memory);
        };
        for (Value value = 0; value < static_cast<Value>(graph_.nodes.size()); ++value) {
            const Node& node = graph_.nodes[value];
            if (graph::is_view(node.op)) continue;
            use(value, is_stage(value));
            for (const Value input : node.inputs) use(input, is_stage(value));
        }
        for (const graph::State& state : graph_.states) use(state.next, false), use(state.previous, false);
        for (const Value value : graph_.results()) use(value, false);
        for (const int memory : outside) inner_.erase(memory);
    }

    /// Calls visit(stage, rows) for every one of these nodes that makes some of a value's rows.
    template <typename Visit>
    void visit_makers(Value value, Rows rows, Visit&& visit) const {
        const Node& node = graph_.nodes[value];
        if (is_stage(value))
            visit(value, rows);
        else if (graph::is_view(node.op) && reads_by_rows(node))
            visit_inputs(value, rows, visit);
    }

    template <typename Visit>
    void visit_inputs(Value value, Rows rows, Visit&& visit) const {
        const Node& node = graph_.nodes[value];
        for (size_t position = 0; position < node.inputs.size(); ++position)
            visit_makers(node.inputs[position], graph::rows_read(graph_, node, position, rows), visit);
    }

    /// How many rows of each node there must be when so much of the last results is there.
    std::vector<int> wanted_rows(double share) const {
        std::vector<int> wanted = done_;
        const auto want = [&](Value value, int rows) {
            wanted[value] = std::max(wanted[value], std::min(round_up(rows, granule_), graph_.shape(value).height));
        };
        for (Value value = last_; value >= first_; --value) {
            if (!is_stage(value)) continue;
            // What is used elsewhere, or not at all, is wanted for itself.
            if (!inner_.contains(plan_.layouts[value].memory))
                want(value, static_cast<int>(share * graph_.shape(value).height));
            if (wanted[value] > done_[value])
                visit_inputs(value, {done_[value], wanted[value]},
                             [&](Value maker, Rows rows) { want(maker, rows.end); });
        }
        return wanted;
    }

    /// A ring holds all from the oldest row that somebody is going to read to the newest that is made before.
    void grow_rings(const std::vector<int>& wanted, std::vector<int>& rings) const {
        std::vector<int> oldest(plan_.memories.size(), std::numeric_limits<int>::max());
        for (Value value = first_; value <= last_; ++value) {
            if (!is_stage(value) || done_[value] == graph_.shape(value).height) continue;
            visit_inputs(value, {done_[value], graph_.shape(value).height}, [&](Value maker, Rows rows) {
                int& row = oldest[plan_.layouts[maker].memory];
                row = std::min(row, rows.first);
            });
        }
        for (Value value = first_; value <= last_; ++value) {
            if (!is_stage(value)) continue;
            const int memory = plan_.layouts[value].memory;
            rings[memory] = std::max(rings[memory], wanted[value] - std::min(oldest[memory], done_[value]));
        }
    }

    void lay_out_rings(const std::vector<int>& rings) {
        for (TensorLayout& layout : plan_.layouts)
            if (inner_.contains(layout.memory) && rings[layout.memory] < layout.rows())
                layout.ring = rings[layout.memory];
        for (const TensorLayout& layout : plan_.layouts) {
            if (layout.ring == 0) continue;
            Memory& memory = plan_.memories[layout.memory];
            memory.bytes = memory_bytes(layout);
            memory.values = memory.bytes;
        }
    }

    LayoutPlan& plan_;
    const Graph& graph_;
    Value first_, last_;
    int granule_;
    std::set<int> inner_;  // memories
    std::vector<int> done_;
};

}  // namespace

int band_granule(const DeviceProfile& profile) { return wants_many_work_items(profile) ? 8 : 4; }

BandPlan plan_bands(LayoutPlan& plan, int rows, const DeviceProfile& profile, const std::vector<BandChoice>& choices) {
    BandPlan result;
    const Value end = static_cast<Value>(plan.graph.nodes.size());
    const auto large = static_cast<double>(large_on(profile));
    double pixels = 1;  // of the largest result
    for (const Value value : plan.graph.results()) {
        const graph::Shape& shape = plan.graph.shape(value);
        pixels = std::max(pixels, static_cast<double>(shape.width) * shape.height);
    }
    const double enlargement = std::max(1.0, kLargestOutput / pixels);
    const auto is_part = [&](Value value) { return !launches(plan.graph.nodes[value]) || works_in_bands(plan, value); };
    for (Value first = 0; first < end; ++first) {
        if (!launches(plan.graph.nodes[first]) || !works_in_bands(plan, first)) continue;
        Value last = first;
        while (last + 1 < end && is_part(last + 1)) ++last;
        Planner planner(plan, first, last, band_granule(profile));
        const auto inner = static_cast<double>(planner.inner_bytes());
        const size_t index = result.choices.size();
        const BandChoice choice = index < choices.size()
                                      ? choices[index]
                                      : BandChoice{rows > 0 || inner > large, rows > 0 || inner * enlargement > large};
        if (choice.for_rings) planner.expect_rings();
        if (choice.in_bands) result.banded.push_back(planner.run(rows > 0 ? rows : kRows));
        result.choices.push_back(choice);
        first = last;
    }
    return result;
}

}  // namespace clarus::runtime
