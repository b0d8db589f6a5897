#include "api/stage_costs.h"

#include <algorithm>
#include <chrono>
#include <limits>
#include <map>

#include "base/image_format.h"
#include "cl/error.h"
#include "graph/partition.h"
#include "runtime/program.h"

namespace clarus {
namespace {

constexpr int kFrames = 5;

template <typename Work>
double least_seconds(Work&& work) {
    double least = std::numeric_limits<double>::infinity();
    for (int run = 0; run < kFrames; ++run) {
        const auto start = std::chrono::steady_clock::now();
        work();
        least = std::min(least, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
    }
    return least;
}

/// A frame of zeros.
class FlatFrame {
  public:
    FlatFrame(const FrameSizes& sizes, const StreamOptions& options) {
        frame_.color = image(sizes.color, options.color_format);
        frame_.depth = image(sizes.render, options.depth_format);
        frame_.motion = image(options.motion_size.value_or(sizes.render), options.motion_format);
        frame_.output = image(sizes.output, options.output_format);
    }
    const FrameDescription& frame() const { return frame_; }

  private:
    Image image(Size size, const ImageFormat& format) {
        return {.host = pixels_.emplace_back(tight_bytes(size, format)).data(), .size = size};
    }

    std::vector<std::vector<std::byte>> pixels_;
    FrameDescription frame_;
};

double least_of_frames(const StageProfile& stage) {
    std::map<int, double> frames;
    for (const StageProfile::Span& span : stage.spans) frames[span.frame] += span.end - span.start;
    double least = stage.seconds;
    for (const auto& [frame, seconds] : frames) least = std::min(least, seconds);
    return least;
}

/// Shares out what ingesting a frame takes among its inputs, by size.
void share_out(double ingest, const graph::Graph& graph, std::vector<double>& seconds) {
    const auto elements = [&](size_t value) {
        const graph::Node& node = graph.nodes[value];
        const bool is_input = graph::traits(node.op).memory == graph::Memory::ingested;
        return is_input ? static_cast<double>(node.shape.elements()) : 0;
    };
    double all = 0;
    for (size_t value = 0; value < graph.nodes.size(); ++value) all += elements(value);
    for (size_t value = 0; value < graph.nodes.size(); ++value) seconds[value] += ingest * elements(value) / all;
}

double seconds_of_copy(ocl::Context& from, ocl::Context& to, size_t bytes) {
    const cl::Buffer source(from.context(), CL_MEM_READ_WRITE, bytes),
        destination(to.context(), CL_MEM_READ_WRITE, bytes);
    from.queue().enqueueFillBuffer(source, cl_uchar(0), 0, bytes);
    from.queue().finish();
    runtime::Transfer transfer(from, to, bytes, "", false);
    return least_seconds([&] { transfer.enqueue(source, destination, {}, {}).destination_ready.wait(); });
}

double seconds_of_event(ocl::Context& from, ocl::Context& to) {
    return least_seconds([&] {
        cl::Event made, seen;
        from.queue().enqueueMarkerWithWaitList(nullptr, &made);
        from.queue().flush();
        const std::vector<cl::Event> waits{made};
        to.queue().enqueueMarkerWithWaitList(&waits, &seen);
        seen.wait();
    });
}

}  // namespace

std::vector<double> measure_nodes(ocl::Context& context, const graph::Graph& fused, runtime::PlanOptions options,
                                  const FrameSizes& sizes, const runtime::FrameConstants& constants) {
    options.profile = true;
    runtime::Tuner tuner(context, options.tuning);
    const std::unique_ptr<runtime::Plan> plan =
        runtime::make_plan(fused, options, context.profile(),
                           [&](const runtime::Problem& problem) { return tuner.select_without_measuring(problem); });
    const std::shared_ptr<ocl::Context> profiling = context.with_another_queue();  // a caller's queue may not
    const runtime::PartPlan part{profiling.get(), plan.get(), ""};
    runtime::Program program(*profiling, {&part, 1}, {}, {}, options, {});
    const FlatFrame flat(sizes, options);
    for (int frame = 0; frame < kFrames; ++frame) program.submit(flat.frame(), constants)->done.wait();
    const std::vector<StageProfile> profile = program.take_profile(0);

    std::vector<double> seconds(fused.nodes.size(), 0);
    const size_t first = plan->ingests() ? 1 : 0;
    if (first) share_out(least_of_frames(profile.front()), fused, seconds);
    if (plan->presents() && plan->presenting < 0)
        seconds[graph::maker_of_memory(fused, fused.output)] += least_of_frames(profile[first + plan->stages.size()]);
    // The plan's nodes are the graph's, in their order, and copies in between, which count for what they are made of.
    size_t stage = 0;
    size_t node = 0;
    for (size_t value = 0; value < plan->layout.graph.nodes.size(); ++value) {
        const bool is_copy =
            node >= fused.nodes.size() || plan->layout.graph.nodes[value].name != fused.nodes[node].name;
        double& its = seconds[is_copy ? std::max<size_t>(node, 1) - 1 : node];
        if (stage < plan->stages.size() && plan->stages[stage].value == static_cast<graph::Value>(value))
            its += least_of_frames(profile[first + stage++]);
        if (!is_copy) ++node;
    }
    return seconds;
}

TransferTime measure_transfer(ocl::Context& from, ocl::Context& to) {
    return ocl::checked("measure what moving between devices takes", [&]() -> TransferTime {
        if (from.shares_memory_with(to)) return {seconds_of_event(from, to), 0};
        constexpr size_t kFew = 4096, kMany = 16 << 20;
        const double few = seconds_of_copy(from, to, kFew), many = seconds_of_copy(from, to, kMany);
        return {few, std::max(0.0, many - few) / static_cast<double>(kMany - kFew)};
    });
}

}  // namespace clarus
