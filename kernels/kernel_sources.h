#pragma once

#include <span>
#include <string_view>

namespace clarus::ocl {

/// An OpenCL C file of `kernels/`, as it was when the library was built.
struct KernelFile {
    std::string_view name;  // "warp.cl", "common.clh"
    std::string_view text;
};

std::span<const KernelFile> kernel_files();

}  // namespace clarus::ocl
