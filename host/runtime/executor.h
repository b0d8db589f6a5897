#pragma once

#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cl/context.h"
#include "clarus/upscaler.h"
#include "runtime/launch.h"
#include "runtime/plan.h"
#include "runtime/profiler.h"
#include "runtime/weights.h"

namespace clarus::runtime {

/// What a frame leaves behind: filled in when `done` completes.
struct FrameResult {
    cl::Event done;
    cl_uint invalid_motion_vectors = 0;
};

/// Runs a plan on its device, frame after frame. The constructor compiles, allocates and uploads; a frame only
/// enqueues.
class Executor {
  public:
    /// `plan` and `options` outlive the executor. `progress` is called with 0…1 while the
    /// driver finishes kernels.
    Executor(ocl::Context& context, const Plan& plan, const UpscalerOptions& options,
             const std::function<void(double)>& progress);

    /// Waits for frames on their way: they use memory of the executor's and of the caller's.
    ~Executor();

    /// Enqueues one frame, whose description has been checked. Where that fails, it waits for what was enqueued, and
    /// the history is as before the frame or is of no use: the next frame must be a reset.
    std::shared_ptr<FrameResult> submit(const FrameDescription& frame, const FrameConstants& constants);

    /// Whether submit was called.
    bool has_run() const { return !results_.empty(); }

    /// A value of the last frame as interleaved floats. Waits. For values that are live at the frame's end.
    std::vector<float> read(graph::Value value) const;

    double largest_jitter_distance() const { return weights_.largest_jitter_distance(); }
    Profiler& profiler() { return profiler_; }

    /// Bytes that copies of host images take on the device, were all images in host memory.
    static size_t staging_bytes(const Plan& plan, const UpscalerOptions& options);

  private:
    struct Stage {
        Launch launch;
        Bindings bindings;
        std::vector<int> input_memories;  // −1 where there is none
        int output_memory = -1;
        int parameters = -1;
        int profile = -1;
    };

    void enqueue_frame(const FrameDescription& frame, const FrameConstants& constants, FrameResult& result);
    void allocate();
    void warm_up(const std::function<void(double)>& progress);
    cl::Buffer zeroed(size_t bytes) const;
    Stage& add_stage(const Kernels& kernels, KernelCall call, std::string name, std::string kernel, double operations,
                     double bytes);
    double ingest_bytes() const;
    const cl::Buffer& memory(int index) const;
    void bind_input(graph::Resource resource, const Image& image, const std::optional<TensorLayout>& layout);
    bool bind_target(const Image& image);  // whether the output must be read back
    /// `after_each` is called when a stage, or a band of it, has been enqueued.
    void run_stages(const FrameConstants& constants, const std::function<void()>& after_each = {});
    void bind(Stage& stage, const FrameConstants& constants);
    void read_back(const Image& image);
    std::shared_ptr<FrameResult> free_result();

    ocl::Context& context_;
    const Plan& plan_;
    const UpscalerOptions& options_;
    const int compiled_before_;  // programs, when the constructor began
    const KernelCall ingest_, present_;
    const Kernels port_kernels_, kernels_;  // apart: a network's do not depend on the caller's formats
    Weights weights_;
    Profiler profiler_;
    cl::Buffer arena_;
    std::vector<cl::Buffer> memories_;  // parts of the arena
    std::vector<int> partners_;         // the memory that stands in for each in odd frames: alternating states
    bool odd_frame_ = false;
    std::vector<Stage> stages_;          // ingest, the plan's, present where none of these does
    size_t presenting_ = 0;              // which of them writes the caller's output
    std::array<cl::Buffer, 3> staging_;  // of host inputs, by resource; made when first needed
    cl::Buffer staging_output_;
    cl::Buffer counter_;  // invalid motion vectors of the frame
    int upload_stage_ = -1, read_back_stage_ = -1;
    std::vector<std::shared_ptr<FrameResult>> results_;
};

}  // namespace clarus::runtime
