#pragma once

// The C++ bindings, to be included from here only. Debian 12's opencl.hpp does not compile with a minimum of 1.2 and a
// target of 3.0: it then calls a function that it defines for lower minimums only.
#undef CL_HPP_MINIMUM_OPENCL_VERSION
#define CL_HPP_MINIMUM_OPENCL_VERSION 110
#include <CL/opencl.hpp>
