#pragma once

#include "cl/opencl.h"

namespace clarus::ocl {

/// Waits, and returns how long the device took, in seconds. The event's queue has profiling enabled. Errors: cl::Error.
inline double seconds_of(const cl::Event& event) {
    event.wait();
    return 1e-9 * static_cast<double>(event.getProfilingInfo<CL_PROFILING_COMMAND_END>() -
                                      event.getProfilingInfo<CL_PROFILING_COMMAND_START>());
}

}  // namespace clarus::ocl
