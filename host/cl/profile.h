#pragma once

#include <string>

#include "cl/opencl.h"
#include "clarus/device.h"

namespace clarus::ocl {

/// Asks the driver, and by small kernels the device itself. What those find is kept in the disk cache.
DeviceProfile profile_of(const cl::Device& device, std::string selector);

/// What compiled programs and measurements of a device depend on: its name, its driver's version, its platform's.
std::string device_identity(const cl::Device& device);

}  // namespace clarus::ocl
