#include "cl/platforms.h"

#include <CL/cl_ext.h>

#include <optional>
#include <utility>

#include "base/log.h"
#include "cl/error.h"

namespace clarus::ocl {
namespace {

// "OpenCL 3.0 PoCL 3.1…" is 3.0.
bool is_at_least_1_2(const cl::Platform& platform) {
    return platform.getInfo<CL_PLATFORM_VERSION>().compare(0, 10, "OpenCL 1.2") >= 0;
}

bool is_usable(const cl::Device& device) {
    return device.getInfo<CL_DEVICE_AVAILABLE>() && device.getInfo<CL_DEVICE_COMPILER_AVAILABLE>();
}

std::vector<cl::Platform> platforms() {
    std::vector<cl::Platform> platforms;
    try {
        cl::Platform::get(&platforms);
    } catch (const cl::Error& error) {
        if (error.err() != CL_PLATFORM_NOT_FOUND_KHR) fail_with_status("ask OpenCL for its platforms", error.err());
    }
    if (platforms.empty())
        fail(ErrorKind::no_device,
             "OpenCL finds no platform. Install a driver: for the processor PoCL (Debian: apt install "
             "pocl-opencl-icd), for "
             "a GPU its vendor's; `clinfo -l` then lists it");
    return platforms;
}

}  // namespace

void fail_without_device() {
    fail(ErrorKind::no_device,
         "OpenCL has a platform but no device. For the processor install PoCL (Debian: apt install pocl-opencl-icd); "
         "where that is installed, it needs a folder for its cache that it may write to: POCL_CACHE_DIR names one");
}

std::string PlacedDevice::selector() const { return fmt::format("{}:{}", platform_index, device_index); }

std::vector<PlacedDevice> placed_devices() {
    std::vector<PlacedDevice> placed;
    std::optional<std::pair<int, cl_int>> failure;  // the last platform's
    int platform_index = -1;
    for (const cl::Platform& platform : platforms()) {
        ++platform_index;
        try {
            if (!is_at_least_1_2(platform)) continue;
            std::vector<cl::Device> devices;
            platform.getDevices(CL_DEVICE_TYPE_ALL, &devices);
            for (size_t i = 0; i < devices.size(); ++i)
                if (is_usable(devices[i])) placed.push_back({platform_index, int(i), devices[i]});
        } catch (const cl::Error& error) {
            log(LogLevel::debug, "platform {} is passed over: {} says {}", platform_index, error.what(),
                status_name(error.err()));
            if (error.err() != CL_DEVICE_NOT_FOUND) failure = {platform_index, error.err()};
        }
    }
    if (placed.empty() && failure)
        fail_with_status(fmt::format("list the devices of platform {}", failure->first), failure->second);
    return placed;
}

DeviceClass device_class(const cl::Device& device) {
    const cl_device_type type = device.getInfo<CL_DEVICE_TYPE>();
    if (type & CL_DEVICE_TYPE_GPU) return DeviceClass::gpu;
    if (type & CL_DEVICE_TYPE_ACCELERATOR) return DeviceClass::dsp;
    return DeviceClass::cpu;
}

bool is_simulator(const cl::Device& device) {
    constexpr cl_device_type every = CL_DEVICE_TYPE_CPU | CL_DEVICE_TYPE_GPU | CL_DEVICE_TYPE_ACCELERATOR;
    return (device.getInfo<CL_DEVICE_TYPE>() & every) == every;
}

bool driver_keeps_programs(const cl::Device& device) {
    const cl::Platform platform(device.getInfo<CL_DEVICE_PLATFORM>());
    return platform.getInfo<CL_PLATFORM_NAME>() == "Portable Computing Language";
}

std::string_view class_name(DeviceClass device_class) {
    switch (device_class) {
        case DeviceClass::gpu:
            return "gpu";
        case DeviceClass::cpu:
            return "cpu";
        case DeviceClass::dsp:
            return "dsp";
    }
    return "";
}

}  // namespace clarus::ocl
