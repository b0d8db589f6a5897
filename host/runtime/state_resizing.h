#pragma once

#include <vector>

#include "runtime/arena.h"
#include "runtime/launch.h"
#include "runtime/plan.h"

namespace clarus::runtime {

/// The kernels that resample each of a plan's states, whatever its size: one call a state.
std::vector<KernelCall> state_resizing(const Plan& plan, const DeviceProfile& profile);

/// Takes what a network carries from frame to frame from a plan to that of another size.
class StateResizing {
  public:
    /// Makes room for the states of `largest`. `kernels` has those of state_resizing and outlives this.
    StateResizing(ocl::Context& context, const Kernels& kernels, const Plan& largest);

    /// Puts the states that the last frame left aside.
    void save(const Plan& plan, const Arena& arena);
    /// Resamples those saved of `from` to the sizes of `to`, where its first frame looks for them.
    void restore(const Plan& from, const Plan& to, const Arena& arena);

    /// Device memory that the constructor takes.
    static size_t bytes(const Plan& largest);

  private:
    ocl::Context& context_;
    const Kernels& kernels_;
    std::vector<cl::Buffer> saved_;  // one a state
};

}  // namespace clarus::runtime
