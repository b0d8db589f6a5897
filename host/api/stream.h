#pragma once

#include <functional>
#include <memory>

#include "api/frame_checks.h"
#include "clarus/upscaler.h"
#include "graph/graph.h"
#include "runtime/executor.h"
#include "runtime/frame_constants.h"
#include "runtime/plan.h"
#include "runtime/tuner.h"

namespace clarus {

/// A graph that runs on one stream of frames: what Upscaler and Interpolator have in common.
class Stream {
  public:
    /// Plans; allocates and compiles nothing yet. `scale` is output over render resolution. Errors: invalid_argument,
    /// naming the option.
    Stream(Device device, graph::Graph graph, FrameSizes sizes, double scale, UpscalerOptions options);
    Stream(const Stream&) = delete;
    Stream& operator=(const Stream&) = delete;

    const graph::Graph& graph() const { return graph_; }
    const FrameSizes& sizes() const { return sizes_; }
    bool needs_depth() const { return plan_->ingest.depth.has_value(); }
    bool needs_motion() const { return plan_->ingest.motion.has_value(); }
    MemoryRequirements memory_requirements() const;

    /// As Upscaler's.
    void prepare(const std::function<void(double)>& progress = {});
    FrameEvent submit(const FrameDescription& frame);
    void reset() { reset_ = true; }
    Upscaler::View view(const std::string& name) const;
    double largest_jitter_distance() const;
    std::vector<StageProfile> take_profile();

  private:
    void plan_with(const std::function<runtime::Selection(const runtime::Problem&)>& select);
    runtime::FrameConstants constants(const FrameDescription& frame, bool without_history) const;

    Device device_;
    FrameSizes sizes_;
    double scale_;
    UpscalerOptions options_;
    graph::Graph graph_;
    runtime::Tuner tuner_;
    std::unique_ptr<runtime::Plan> plan_;
    std::unique_ptr<runtime::Executor> executor_;
    bool reset_ = true;  // the next frame starts without history
    Vec2 previous_jitter_;
};

}  // namespace clarus
