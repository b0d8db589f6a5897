#pragma once

#include <vector>

#include "cl/context.h"
#include "runtime/plan.h"

namespace clarus::runtime {

/// The device memory of a plan's values: one buffer, of which each of the plan's memories is a part. The two memories
/// of a double-buffered state change roles every frame. What the plan hands over to others, and what they hand over to
/// it, is in buffers of whoever runs it.
class Arena {
  public:
    /// Zeros everywhere. Errors: out_of_memory, device.
    Arena(ocl::Context& context, const Plan& plan);

    /// Lays out another plan's memories in the same buffer, or in a new one where it needs more. Values are lost.
    void lay_out(const Plan& plan);

    /// The buffer of a memory that is handed in, until another is.
    void hand_in(int index, const cl::Buffer& buffer) { memories_[index] = buffer; }

    /// Begins a frame.
    void next_frame() { odd_frame_ = !odd_frame_; }

    /// By index into LayoutPlan::memories: in this frame, or in the one after it.
    const cl::Buffer& memory(int index) const { return memories_[odd_frame_ ? partners_[index] : index]; }
    const cl::Buffer& memory_next_frame(int index) const { return memories_[odd_frame_ ? index : partners_[index]]; }

  private:
    void allocate(size_t bytes);

    ocl::Context& context_;
    cl::Buffer whole_;
    size_t bytes_ = 0;
    std::vector<cl::Buffer> memories_;  // parts of the whole, and what was handed in
    std::vector<int> partners_;         // the memory that stands in for each in odd frames
    bool odd_frame_ = false;
};

}  // namespace clarus::runtime
