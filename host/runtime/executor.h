#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "cl/context.h"
#include "clarus/stream.h"
#include "runtime/arena.h"
#include "runtime/launch.h"
#include "runtime/plan.h"
#include "runtime/ports.h"
#include "runtime/profiler.h"
#include "runtime/state_resizing.h"
#include "runtime/weights.h"

namespace clarus::runtime {

/// What a frame leaves behind: filled in when `done` completes.
struct FrameResult {
    cl::Event done;
    cl_uint invalid_motion_vectors = 0;
    std::vector<std::shared_ptr<const FrameResult>> parts;  // where several plans work on a frame
    int presenting = 0;                                     // the part that ends the frame
    std::string device;                                     // as errors name it; empty where parts have their own
};

/// The buffers of what a plan imports and exports, by port, where it is a part of a network.
struct HandedIn {
    std::vector<cl::Buffer> imports, exports;
};

/// What a frame leaves for the next, where both have it: after one frame, and before the other.
struct KeptMemory {
    std::string name;  // its own within a program: "part 0, state 1, history"
    TensorLayout layout;
    ocl::Context* context;
    cl::Buffer buffer;
    size_t bytes;
};

/// Runs a plan on its device, frame after frame. The constructor compiles, allocates and uploads; a frame only
/// enqueues.
class Executor {
  public:
    /// The plan that is run, at first of the largest size, and `options` outlive the executor. `others`: plans of the
    /// same parameters at smaller sizes, where the size will change; what they add is compiled and packed, too. Without
    /// them, states are not resampled. `progress` is called with 0…1 while the driver finishes kernels.
    Executor(ocl::Context& context, const Plan& plan, std::span<const std::unique_ptr<Plan>> others,
             const StreamOptions& options, const HandedIn& handed_in, const std::function<void(double)>& progress);

    /// Waits for frames on their way: they use memory of the executor's and of the caller's.
    ~Executor();

    /// Goes on with a plan of the same parameters at another size, with the same kernels for convolutions, whose
    /// weights stay packed; those of other convolutions are packed. States are resampled to its sizes where
    /// `keeps_states`, else of no use: the next frame must be a reset. Waits for nothing. Allocates where the plan
    /// needs more memory than those before, compiles where it has other kernels.
    void change_plan(const Plan& plan, bool keeps_states);

    /// What the next frames import and export.
    void hand_in(const HandedIn& handed_in);

    /// Enqueues one frame, whose description has been checked, after `wait_for`, events of the device's context, which
    /// take the place of those that the frame names. Where that fails, it waits for what was enqueued, and the history
    /// is as before the frame or is of no use: the next frame must be a reset.
    std::shared_ptr<FrameResult> submit(const FrameDescription& frame, const FrameConstants& constants,
                                        std::span<const cl_event> wait_for = {});

    /// Whether submit was called.
    bool has_run() const { return !results_.empty(); }

    /// The plan's states.
    std::vector<KeptMemory> kept() const;
    /// The next frame follows on states that were written there.
    void states_are_written() { has_states_ = true; }

    /// A value of the last frame as interleaved floats. Waits. For values that are live at the frame's end.
    std::vector<float> read(graph::Value value) const;

    /// Bytes that copies of host images take on the device, were all images in host memory, and what resizing needs.
    static size_t staging_bytes(const Plan& plan, bool resizes, const StreamOptions& options);

    double largest_jitter_distance() const { return weights_.largest_jitter_distance(); }
    Profiler& profiler() { return profiler_; }

  private:
    struct Stage {
        Launch launch;
        Bindings bindings;
        std::vector<int> input_memories;  // −1 where there is none
        int output_memory = -1;
        int parameters = -1;
        int profile = -1;
    };

    void make_stages();
    Stage make_stage(const Kernels& kernels, KernelCall call, std::string name, std::string kernel, double operations,
                     double bytes);
    void warm_up(std::span<const std::unique_ptr<Plan>> others, const std::function<void(double)>& progress);
    void run_unseen(const std::function<void()>& after_each);
    void enqueue_frame(const FrameDescription& frame, const FrameConstants& constants,
                       std::span<const cl_event> wait_for, FrameResult& result);
    /// What writes the caller's output; null where this plan does not make it.
    Stage* presenting();
    /// `after_each` is called when a stage, or a band of it, has been enqueued.
    void run_stages(const FrameConstants& constants, const std::function<void()>& after_each = {});
    void bind(Stage& stage, const FrameConstants& constants);
    std::shared_ptr<FrameResult> free_result();

    ocl::Context& context_;
    const Plan* plan_;
    const StreamOptions& options_;
    const int compiled_before_;  // programs, when the constructor began
    Kernels port_kernels_;
    Kernels kernels_;  // apart: a network's do not depend on the caller's formats
    Weights weights_;
    Profiler profiler_;
    Arena arena_;
    Ports ports_;
    std::optional<StateResizing> resizing_;
    std::optional<Stage> exposure_;  // where a kernel makes it
    std::optional<Stage> ingest_;
    std::vector<Stage> stages_;     // the plan's
    std::optional<Stage> present_;  // where none of these writes the caller's output
    cl::Buffer counter_;            // invalid motion vectors of the frame
    cl::Buffer exposure_value_;     // what exposure_ makes, kExposureBytes
    std::vector<std::shared_ptr<FrameResult>> results_;
    bool has_states_ = false;
};

}  // namespace clarus::runtime
