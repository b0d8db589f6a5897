#pragma once

// The C++ bindings, to be included from here only, of OpenCL 1.2.
#include <CL/opencl.hpp>
