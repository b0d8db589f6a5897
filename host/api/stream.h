#pragma once

#include <functional>
#include <memory>
#include <optional>

#include "api/frame_checks.h"
#include "clarus/upscaler.h"
#include "graph/graph.h"
#include "runtime/executor.h"
#include "runtime/frame_constants.h"
#include "runtime/kept_choices.h"
#include "runtime/plan.h"
#include "runtime/tuner.h"

namespace clarus {

/// What a stream computes of frames of one size.
struct SizedGraph {
    graph::Graph graph;
    FrameSizes sizes;
    double scale;  // of the graph's result over render resolution
};

/// A graph that runs on one stream of frames: what Upscaler and Interpolator have in common.
class Stream {
  public:
    /// Makes the graph for frames of this render size. Errors: invalid_argument.
    using Build = std::function<SizedGraph(Size render)>;

    /// Plans; allocates and compiles nothing yet. `others`: render sizes where the graph has other nodes, of which
    /// kernels are prepared, too, where the resolution is dynamic. Errors: invalid_argument, naming the option; those
    /// of `build`.
    Stream(Device device, Build build, Size render, runtime::PlanOptions options, std::vector<Size> others = {});
    Stream(const Stream&) = delete;
    Stream& operator=(const Stream&) = delete;

    /// Of frames of the largest size.
    const graph::Graph& graph() const { return largest_.graph; }
    const FrameSizes& sizes() const { return largest_.sizes; }
    /// Of frames of this size. Errors: invalid_argument.
    FrameSizes sizes(Size render) const;
    bool needs_depth() const { return plan_->ingest.depth.has_value(); }
    bool needs_motion() const { return plan_->ingest.motion.has_value(); }
    const MemoryRequirements& memory_requirements() const { return memory_; }

    /// As Upscaler's.
    void prepare(const std::function<void(double)>& progress = {});
    FrameEvent submit(const FrameDescription& frame);
    void reset() { reset_ = true; }
    Upscaler::View view(const std::string& name) const;
    double largest_jitter_distance() const;
    std::vector<StageProfile> take_profile();

  private:
    using Select = std::function<runtime::Selection(const runtime::Problem&)>;
    std::unique_ptr<runtime::Plan> plan_of_largest(const Select& select) const;
    /// A plan with the kernels of `choices`, where it has them.
    std::unique_ptr<runtime::Plan> plan_like(const runtime::KeptChoices& choices, const graph::Graph& graph) const;
    /// Of half the size, and of the other sizes that can be.
    std::vector<std::unique_ptr<runtime::Plan>> other_plans() const;
    SizedGraph built(Size render) const;
    /// Goes on with frames of another size.
    void change_size(const SizedGraph& sized, bool keeps_history);
    void begin_with(std::unique_ptr<runtime::Plan> plan_of_largest);
    runtime::FrameConstants constants(const FrameDescription& frame, bool without_history) const;

    Device device_;
    Build build_;
    runtime::PlanOptions options_;
    std::vector<Size> others_;
    SizedGraph largest_;
    FrameSizes sizes_;  // of the last frame
    double scale_;      // likewise
    runtime::Tuner tuner_;
    std::unique_ptr<runtime::Plan> plan_;  // of frames of these sizes
    MemoryRequirements memory_;
    std::optional<runtime::KeptChoices> choices_;
    std::unique_ptr<runtime::Executor> executor_;
    bool reset_ = true;     // the next frame starts without history
    Vec2 previous_jitter_;  // in render pixels of the last frame
};

}  // namespace clarus
