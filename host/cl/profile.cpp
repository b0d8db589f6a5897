#include "cl/profile.h"

#include <fmt/format.h>

#include <algorithm>

#include "cl/platforms.h"
#include "cl/probe.h"

namespace clarus::ocl {
namespace {

// What `Name` asks for, or `fallback` where the driver does not know the question.
template <cl_device_info Name, typename T>
T info_or(const cl::Device& device, T fallback) {
    T value = fallback;
    const cl_int status = clGetDeviceInfo(device(), Name, sizeof value, &value, nullptr);
    return status == CL_SUCCESS ? value : fallback;
}

// Drivers pad names with spaces, tabs and null characters.
std::string trimmed(const std::string& text) {
    constexpr std::string_view padding(" \t\n\0", 4);
    const size_t first = text.find_first_not_of(padding);
    return first == text.npos ? "" : text.substr(first, text.find_last_not_of(padding) - first + 1);
}

bool can_be_parted(const cl::Device& device) {
    if (info_or<CL_DEVICE_PARTITION_MAX_SUB_DEVICES, cl_uint>(device, 0) < 2) return false;
    const auto ways = device.getInfo<CL_DEVICE_PARTITION_PROPERTIES>();
    return std::any_of(ways.begin(), ways.end(), [](cl_device_partition_property way) {
        return way == CL_DEVICE_PARTITION_BY_COUNTS || way == CL_DEVICE_PARTITION_EQUALLY;
    });
}

cl::Platform platform_of(const cl::Device& device) { return cl::Platform(device.getInfo<CL_DEVICE_PLATFORM>()); }

}  // namespace

std::string device_identity(const cl::Device& device) {
    const cl::Platform platform = platform_of(device);
    return fmt::format("{}\n{}\n{}\n{}\n{}", device.getInfo<CL_DEVICE_NAME>(), device.getInfo<CL_DRIVER_VERSION>(),
                       device.getInfo<CL_DEVICE_VERSION>(), platform.getInfo<CL_PLATFORM_NAME>(),
                       platform.getInfo<CL_PLATFORM_VERSION>());
}

DeviceProfile profile_of(const cl::Device& device, std::string selector) {
    const std::string extensions = fmt::format(" {} ", device.getInfo<CL_DEVICE_EXTENSIONS>());
    const auto has = [&](std::string_view extension) {
        return extensions.find(fmt::format(" {} ", extension)) != std::string::npos;
    };
    const Abilities abilities = probe(device);

    DeviceProfile profile;
    profile.selector = std::move(selector);
    profile.name = trimmed(device.getInfo<CL_DEVICE_NAME>());
    profile.vendor = trimmed(device.getInfo<CL_DEVICE_VENDOR>());
    profile.platform = trimmed(platform_of(device).getInfo<CL_PLATFORM_NAME>());
    profile.driver_version = trimmed(device.getInfo<CL_DRIVER_VERSION>());
    profile.opencl_version = trimmed(device.getInfo<CL_DEVICE_VERSION>());
    profile.device_class = device_class(device);
    profile.simulator = is_simulator(device);
    profile.compute_units = int(device.getInfo<CL_DEVICE_MAX_COMPUTE_UNITS>());
    profile.clock_mhz = int(info_or<CL_DEVICE_MAX_CLOCK_FREQUENCY, cl_uint>(device, 0));
    profile.float_vector_width = std::max(1, int(info_or<CL_DEVICE_NATIVE_VECTOR_WIDTH_FLOAT, cl_uint>(device, 1)));
    profile.max_work_group_size = device.getInfo<CL_DEVICE_MAX_WORK_GROUP_SIZE>();
    profile.global_memory = device.getInfo<CL_DEVICE_GLOBAL_MEM_SIZE>();
    profile.max_allocation = device.getInfo<CL_DEVICE_MAX_MEM_ALLOC_SIZE>();
    profile.local_memory = device.getInfo<CL_DEVICE_LOCAL_MEM_SIZE>();
    profile.local_memory_is_dedicated = device.getInfo<CL_DEVICE_LOCAL_MEM_TYPE>() == CL_LOCAL;
    profile.memory_alignment = std::max<size_t>(1, device.getInfo<CL_DEVICE_MEM_BASE_ADDR_ALIGN>() / 8);  // from bits
    profile.unified_memory = info_or<CL_DEVICE_HOST_UNIFIED_MEMORY, cl_bool>(device, CL_FALSE);
    profile.images = device.getInfo<CL_DEVICE_IMAGE_SUPPORT>();
    profile.half_storage = abilities.half_storage;
    profile.half_arithmetic = abilities.half_arithmetic;
    profile.int8_dot_product = has("cl_khr_integer_dot_product");
    profile.vnni = abilities.vnni;
    profile.bf16 = abilities.bf16;
    profile.fast_fma = abilities.fast_fma;
    profile.subgroups = has("cl_khr_subgroups") || info_or<CL_DEVICE_MAX_NUM_SUB_GROUPS, cl_uint>(device, 0) > 0;
    profile.sub_devices = can_be_parted(device);
    profile.gl_sharing = has("cl_khr_gl_sharing");
    profile.external_memory = has("cl_khr_external_memory");
    return profile;
}

}  // namespace clarus::ocl
