#pragma once

#include "cl/opencl.h"

namespace clarus::ocl {

/// Compiles and links for the device. Errors: cl::Error with the compiler's status. The bindings' own `build` asks for
/// the log in any case, and where there is none, its error is that.
inline void build_program(const cl::Program& program, const cl::Device& device) {
    const cl_device_id id = device();
    const cl_int status = clBuildProgram(program(), 1, &id, nullptr, nullptr, nullptr);
    if (status != CL_SUCCESS) throw cl::Error(status, "clBuildProgram");
}

}  // namespace clarus::ocl
