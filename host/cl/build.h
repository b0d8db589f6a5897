#pragma once

#include "cl/opencl.h"

namespace clarus::ocl {

/// The compiler's warnings are left out: PoCL's counts them on standard error, which is the program's that links us.
constexpr const char* kCompilerOptions = "-w";

/// Compiles and links for the device; what is compiled already takes no options. Errors: cl::Error with the compiler's
/// status. The bindings' own `build` asks for the log in any case, and where there is none, its error is that.
inline void build_program(const cl::Program& program, const cl::Device& device,
                          const char* options = kCompilerOptions) {
    const cl_device_id id = device();
    const cl_int status = clBuildProgram(program(), 1, &id, options, nullptr, nullptr);
    if (status != CL_SUCCESS) throw cl::Error(status, "clBuildProgram");
}

}  // namespace clarus::ocl
