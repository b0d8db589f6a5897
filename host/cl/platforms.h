#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "cl/opencl.h"
#include "clarus/device.h"

namespace clarus::ocl {

/// A device and its place: platforms are counted with those that have no device, as `clinfo -l` does.
struct PlacedDevice {
    int platform_index = 0;
    int device_index = 0;
    cl::Device device;

    std::string selector() const;
};

/// Every device that is available and has a compiler, in the order of their places. A platform older than OpenCL 1.2 or
/// that answers with an error is passed over. Errors: no_device where the loader finds no platform; the status's kind,
/// where no platform has a device and one answered with an error.
std::vector<PlacedDevice> placed_devices();

/// For where there are none: the error no_device, with what helps.
[[noreturn]] void fail_without_device();

DeviceClass device_class(const cl::Device& device);

/// A device that claims to be of every type, as Oclgrind's does.
bool is_simulator(const cl::Device& device);

/// Whether the driver itself keeps what it compiles from source, from process to process. PoCL does, kernel by kernel
/// and work-group size by work-group size; asked for a program's binary it compiles all of that once more, in a form
/// that never runs (PoCL 3.1: as long again as the first time).
bool driver_keeps_programs(const cl::Device& device);

/// "gpu", "cpu" or "dsp".
std::string_view class_name(DeviceClass device_class);

}  // namespace clarus::ocl
