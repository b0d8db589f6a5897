#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "api/frame_checks.h"
#include "api/history.h"
#include "clarus/upscaler.h"
#include "graph/graph.h"
#include "runtime/frame_constants.h"
#include "runtime/kept_choices.h"
#include "runtime/plan.h"
#include "runtime/program.h"
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
    bool needs_depth() const;
    bool needs_motion() const;
    const MemoryRequirements& memory_requirements() const { return memory_; }
    /// Whose queue runs the first part of frames, all of them where there is one device.
    const ocl::Context& context() const { return *parts_.front().context; }

    /// As Upscaler's.
    void prepare(const std::function<void(double)>& progress = {});
    FrameEvent submit(const FrameDescription& frame);
    void reset() { reset_ = true; }
    /// Whether the graph has states.
    bool keeps_history() const { return !graph().states.empty(); }
    /// What is kept after the last frame. Waits. Errors: device.
    History history() const;
    /// Goes on after that frame. Prepares. Errors: invalid_argument where it is of another form than what is kept here;
    /// those of prepare.
    void restore(const History& history);
    Upscaler::View view(const std::string& name) const;
    double largest_jitter_distance() const;
    std::vector<StageProfile> take_profile();

    /// How the stages are shared out among several devices, by parts that run one after the other; empty of one device.
    std::vector<PlacedPart> placement() const;
    /// Upscaler::seconds_alone.
    const std::vector<double>& seconds_alone() const { return seconds_alone_; }

  private:
    using Select = std::function<runtime::Selection(const runtime::Problem&)>;

    /// What one device does of a frame by one of its queues; all of it where there is one device.
    struct Part {
        std::shared_ptr<ocl::Context> context;
        int device = 0;
        graph::Graph graph;
        std::unique_ptr<runtime::Tuner> tuner;
        std::unique_ptr<runtime::Plan> plan;
        double seconds = 0;  // PlacedPart::seconds
    };

    std::string name_of(int device) const;  // as errors name it; empty where there is one
    bool has_one_part() const { return parts_.size() == 1; }
    const runtime::Plan& plan() const { return *parts_.front().plan; }
    bool ingests(std::optional<runtime::TensorLayout> runtime::IngestProblem::*resource) const;
    std::vector<runtime::PartPlan> part_plans() const;

    /// Cuts the network by `places` (graph::partition) and plans each part without measuring. `seconds`:
    /// [device][node], where they are known.
    void part_out(const graph::Graph& fused, const std::vector<int>& places,
                  const std::vector<std::vector<double>>& seconds = {});
    /// Measures every stage on every device and cuts where that makes most frames a second.
    void place_by_measuring(const std::function<void(double)>& progress);
    /// With a fallback, goes on without the device that failed, `why` where that is known; false where none did, or
    /// there is no other.
    bool leave_failed_device(std::string_view why = {});
    void plan_part(Part& part, const Select& select) const;
    void take_memory_requirements();

    /// A plan with the kernels of `choices`, where it has them; else with others, of which those of convolutions are
    /// kept.
    std::unique_ptr<runtime::Plan> plan_like(runtime::KeptChoices& choices, const graph::Graph& graph) const;
    /// Of half the size, and of the other sizes that can be.
    std::vector<std::unique_ptr<runtime::Plan>> other_plans();
    SizedGraph built(Size render) const;
    /// Goes on with frames of another size.
    void change_size(const SizedGraph& sized, bool keeps_history);
    /// That callers' buffers must be of; null where devices share none.
    cl_context context_of_images() const;
    runtime::FrameConstants constants(const FrameDescription& frame, bool without_history) const;
    /// What last bits depend on: devices, drivers and kernels.
    std::string computed_by() const;

    Device device_;
    Build build_;
    runtime::PlanOptions options_;
    std::vector<Size> others_;
    SizedGraph largest_;
    FrameSizes sizes_;         // of the last frame
    double scale_;             // likewise
    std::vector<Part> parts_;  // their plans are of frames of these sizes
    std::vector<graph::Link> links_;
    std::vector<int> places_;  // devices of the fused graph's nodes
    std::vector<bool> lost_;   // by device
    std::vector<double> seconds_alone_;
    MemoryRequirements memory_;
    std::optional<runtime::KeptChoices> choices_;
    std::unique_ptr<runtime::Program> program_;
    bool reset_ = true;     // the next frame starts without history
    Vec2 previous_jitter_;  // in render pixels of the last frame
};

}  // namespace clarus
