#pragma once

#include <chrono>
#include <span>

#include "cl/opencl.h"

namespace clarus::ocl {

/// Waits, and returns how long the device took, in seconds. The event's queue has profiling enabled. Errors: cl::Error.
inline double seconds_of(const cl::Event& event) {
    event.wait();
    return 1e-9 * static_cast<double>(event.getProfilingInfo<CL_PROFILING_COMMAND_END>() -
                                      event.getProfilingInfo<CL_PROFILING_COMMAND_START>());
}

/// Waits until all have completed or failed, but not longer than that, and returns whether they have. What is no event
/// counts as completed.
bool wait_at_most(std::span<const cl_event> events, std::chrono::duration<double> longest);

}  // namespace clarus::ocl
