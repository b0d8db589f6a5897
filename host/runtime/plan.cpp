#include "runtime/plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "base/image_format.h"
#include "base/rounding.h"
#include "graph/passes.h"
#include "runtime/short_launches.h"
#include "runtime/weights.h"

namespace clarus::runtime {
namespace {

using graph::Value;

Storage storage_for(Precision precision, const DeviceProfile& profile) {
    const bool half = precision == Precision::fp16 || (precision == Precision::automatic && profile.half_arithmetic);
    return half && profile.half_storage ? Storage::f16 : Storage::f32;
}

IngestProblem ingest_problem(const LayoutPlan& plan, const StreamOptions& options) {
    IngestProblem problem;
    problem.options = &options;
    for (Value value = 0; value < static_cast<Value>(plan.graph.nodes.size()); ++value) {
        const graph::Operator& op = plan.graph.nodes[value].op;
        if (const auto* input = std::get_if<graph::Input>(&op)) {
            layout_of(input->resource, problem) = plan.layouts[value];
        } else if (const auto* plane = std::get_if<graph::Plane>(&op)) {
            auto& layout = plane->scalar == graph::FrameScalar::jitter_x   ? problem.jitter_x
                           : plane->scalar == graph::FrameScalar::jitter_y ? problem.jitter_y
                                                                           : problem.scale;
            layout = plan.layouts[value];
        }
    }
    return problem;
}

PlannedStage plan_stage(const LayoutPlan& plan, Value value) {
    const graph::Node& node = plan.graph.nodes[value];
    PlannedStage stage;
    stage.value = value;
    stage.problem.node = node;
    stage.problem.output = plan.layouts[value];
    stage.problem.bytes = tensor_bytes(stage.problem.output);
    for (const Value input : node.inputs) {
        stage.problem.inputs.push_back(plan.layouts[input]);
        stage.problem.bytes += tensor_bytes(plan.layouts[input]);
    }
    if (const auto* convolution = std::get_if<graph::Convolution>(&node.op))
        stage.problem.parameters = plan.graph.parameters[convolution->parameters].get();
    stage.problem.operations = graph::operations(plan.graph, node);
    return stage;
}

void check_granule(const PlannedStage& stage, int granule) {
    const KernelCall& call = stage.lowered.call;
    const int group = static_cast<int>(call.local[call.row_axis]) * call.rows_an_item;
    const int items = ceil_divide(stage.problem.output.height, call.rows_an_item);
    if (granule % group != 0 || static_cast<int>(call.global[call.row_axis]) != items)
        throw std::logic_error(fmt::format("{} by {} cannot work on bands: {} work-items of {} rows in groups of {}",
                                           stage.problem.node.name, stage.selection.describe(),
                                           call.global[call.row_axis], call.rows_an_item, call.local[call.row_axis]));
}

const BandedNodes* find_banded(const std::vector<BandedNodes>& banded, Value value) {
    const auto found = std::find_if(banded.begin(), banded.end(), [&](const BandedNodes& nodes) {
        return value >= nodes.first && value <= nodes.last;
    });
    return found == banded.end() ? nullptr : &*found;
}

std::vector<StageRows> order_of(const std::vector<PlannedStage>& stages, const std::vector<BandedNodes>& banded) {
    std::vector<StageRows> launches;
    std::map<Value, int> stage_of;
    for (int stage = 0; stage < static_cast<int>(stages.size()); ++stage) stage_of[stages[stage].value] = stage;
    for (int stage = 0; stage < static_cast<int>(stages.size()); ++stage) {
        const Value value = stages[stage].value;
        const BandedNodes* nodes = find_banded(banded, value);
        if (!nodes)
            launches.push_back({stage});
        else if (value == nodes->first)
            for (const Band& band : nodes->order) launches.push_back({stage_of.at(band.value), band.first, band.end});
    }
    return launches;
}

/// Launches of GPUs split, so that none is long.
std::vector<StageRows> shortened(const std::vector<StageRows>& launches, const std::vector<PlannedStage>& stages,
                                 const DeviceProfile& profile) {
    std::vector<StageRows> result;
    for (const StageRows& launch : launches) {
        const PlannedStage& stage = stages[launch.stage];
        const KernelCall& call = stage.lowered.call;
        const graph::Rows all = rows_of(call), rows = launch.end == 0 ? all : graph::Rows{launch.first, launch.end};
        const double share = static_cast<double>(rows.end - rows.first) / (all.end - all.first);
        const auto pieces = short_launches(call, rows, share * most_seconds(stage.problem, profile), profile);
        if (pieces.size() == 1)
            result.push_back(launch);
        else
            for (const graph::Rows& piece : pieces) result.push_back({launch.stage, piece.first, piece.end});
    }
    return result;
}

/// The pipeline's output within the result of a stage that could present it, if it is there as it would be read again.
std::optional<Presented> presented_by(const PlannedStage& stage, const TensorLayout& output,
                                      const StreamOptions& options) {
    const TensorLayout& result = stage.problem.output;
    const bool plain = options.color_space == ColorSpace::srgb && output.storage == Storage::f32;
    if (!plain || !std::holds_alternative<graph::Pointwise>(stage.problem.node.op) || result.block != output.block ||
        result.width != output.width || result.height != output.height)
        return {};
    const int first = (output.offset - result.offset) / (output.block * output.block);
    if (first < 0 || first + output.channels > result.channels) return {};
    return Presented{first, output.channels, options.output_format};
}

/// Has the stage that is the last to write where the pipeline's output is write it to the caller's image, too: what it
/// has in its registers need not be read again.
void present_early(Plan& plan, const StreamOptions& options, const DeviceProfile& profile) {
    if (plan.layout.graph.output < 0) return;
    const TensorLayout& output = plan.layout.layouts[plan.layout.graph.output];
    const auto last = std::find_if(plan.stages.rbegin(), plan.stages.rend(), [&](const PlannedStage& stage) {
        return stage.problem.output.memory == output.memory;
    });
    if (last == plan.stages.rend()) return;
    last->problem.presented = presented_by(*last, output, options);
    if (!last->problem.presented) return;
    if (last->selection.implementation->preference(last->problem, profile) == 0) {  // presents no such result
        last->problem.presented.reset();
        return;
    }
    plan.presenting = static_cast<int>(plan.stages.rend() - last) - 1;
    last->lowered = last->selection.lower(last->problem);
    last->problem.bytes += static_cast<double>(tight_bytes({output.width, output.height}, options.output_format));
}

}  // namespace

double tensor_bytes(const TensorLayout& layout) {
    return static_cast<double>(layout.width / layout.samples) * (layout.height / layout.samples) * layout.channels *
           bytes_of(layout.storage);
}

std::map<int, Lowered> Plan::convolutions() const {
    std::map<int, Lowered> result;
    for (const PlannedStage& stage : stages)
        if (const auto* convolution = std::get_if<graph::Convolution>(&stage.problem.node.op))
            result[convolution->parameters] = stage.lowered;
    return result;
}

bool only_moves(const PlannedStage& stage) {
    if (std::holds_alternative<graph::Numbers>(stage.problem.node.op)) return true;
    const auto* program = std::get_if<graph::Pointwise>(&stage.problem.node.op);
    return program && program->steps.empty() && stage.problem.node.inputs.size() == 1;
}

Precision common_precision(Precision asked, std::span<const DeviceProfile> devices) {
    const bool halves = std::all_of(devices.begin(), devices.end(), [&](const DeviceProfile& profile) {
        return storage_for(asked, profile) == Storage::f16;
    });
    return halves ? Precision::fp16 : asked == Precision::bf16 ? asked : Precision::fp32;
}

std::vector<const TensorLayout*> Plan::imports() const {
    std::vector<const TensorLayout*> layouts;
    for (Value value = 0; value < static_cast<Value>(layout.graph.nodes.size()); ++value) {
        const auto* import = std::get_if<graph::Import>(&layout.graph.nodes[value].op);
        if (!import) continue;
        layouts.resize(std::max<size_t>(layouts.size(), import->port + 1));
        layouts[import->port] = &layout.layouts[value];
    }
    return layouts;
}

std::vector<const TensorLayout*> Plan::exports() const {
    std::vector<const TensorLayout*> layouts;
    for (const Value value : layout.graph.exports) layouts.push_back(&layout.layouts[value]);
    return layouts;
}

bool Plan::ingests() const {
    const auto written = destinations(ingest);
    return std::any_of(written.begin(), written.end(), [](const auto* each) { return each->has_value(); });
}

std::unique_ptr<Plan> make_plan(const graph::Graph& graph, const PlanOptions& options, const DeviceProfile& profile,
                                const std::function<Selection(const Problem&)>& select,
                                const std::vector<BandChoice>& bands) {
    auto plan = std::make_unique<Plan>();
    plan->layout = lay_out(graph::fuse(graph, options.views), storage_for(options.precision, profile));
    const auto [banded, band_choices] = plan_bands(plan->layout, options.band_rows, profile, bands);
    plan->band_choices = band_choices;
    check_sizes(plan->layout);
    plan->memory = plan_memory(plan->layout, profile.memory_alignment, banded);
    plan->ingest = ingest_problem(plan->layout, options);
    for (Value value = 0; value < static_cast<Value>(plan->layout.graph.nodes.size()); ++value) {
        if (implementations(plan->layout.graph.nodes[value]).empty()) continue;
        PlannedStage stage = plan_stage(plan->layout, value);
        stage.problem.bf16 = options.precision == Precision::bf16 && profile.bf16 && stage.problem.parameters;
        stage.selection = select(stage.problem);
        stage.lowered = stage.selection.lower(stage.problem);
        if (find_banded(banded, value)) check_granule(stage, band_granule(profile));
        plan->stages.push_back(std::move(stage));
    }
    present_early(*plan, options, profile);
    plan->launches = shortened(order_of(plan->stages, banded), plan->stages, profile);
    plan->weight_bytes = Weights::bytes(plan->layout.graph, plan->convolutions());
    return plan;
}

}  // namespace clarus::runtime
