#pragma once

#include <string_view>
#include <utility>

#include "base/error.h"
#include "cl/opencl.h"

namespace clarus::ocl {

/// "CL_OUT_OF_RESOURCES" for −5; "OpenCL status −12345" for a code that the standard does not name.
std::string status_name(cl_int status);

/// Throws the Error that a failed OpenCL call means: out_of_memory where the status says so, else device. `doing` says
/// what was attempted, as in "allocate 3 MiB".
[[noreturn]] void fail_with_status(std::string_view doing, cl_int status);

/// Runs f, which calls OpenCL; what cl::Error it throws becomes a clarus::Error saying that `doing` failed.
template <typename F>
auto checked(std::string_view doing, F&& f) -> decltype(f()) {
    try {
        return std::forward<F>(f)();
    } catch (const cl::Error& error) {
        fail_with_status(doing, error.err());
    }
}

}  // namespace clarus::ocl
