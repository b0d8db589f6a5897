#pragma once

#include "cl/opencl.h"

namespace clarus::ocl {

/// What a device can do, found by compiling and running small kernels: drivers report less than they can do, and more.
struct Abilities {
    bool half_storage = false;
    bool half_arithmetic = false;
    bool fast_fma = false;
    bool vnni = false;
    bool bf16 = false;
};

/// From the disk cache where it was probed before. What a device fails to compile or run it lacks.
Abilities probe(const cl::Device& device);

}  // namespace clarus::ocl
