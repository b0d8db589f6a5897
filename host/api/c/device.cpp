#include "clarus/device.h"

#include <cstddef>
#include <string>
#include <vector>

#include "api/c/guard.h"
#include "api/c/handles.h"
#include "api/c/structs.h"
#include "clarus/clarus.h"

using namespace clarus::c;

extern "C" {

clarus_status clarus_device_open(const char* selector, clarus_device** device) {
    return guarded([&] {
        clarus_device*& opened = given(device, "device");
        opened = new clarus_device{clarus::Device::open(selector ? selector : "auto")};
    });
}

clarus_status clarus_device_adopt(cl_context context, cl_device_id id, cl_command_queue queue, clarus_device** device) {
    return guarded([&] {
        clarus_device*& adopted = given(device, "device");
        adopted = new clarus_device{clarus::Device::adopt(context, id, queue)};
    });
}

clarus_status clarus_device_together(const clarus_device* const* devices, size_t count, clarus_device** device) {
    return guarded([&] {
        clarus_device*& all = given(device, "device");
        if (count > 0) given(devices, "devices");
        std::vector<clarus::Device> together;
        for (size_t index = 0; index < count; ++index)
            together.push_back(given(devices[index], "one of the devices").device);
        all = new clarus_device{clarus::Device::together(together)};
    });
}

size_t clarus_device_count(const clarus_device* device) { return device ? device->profiles.size() : 0; }

const char* clarus_device_selector(const clarus_device* device, size_t index) {
    return index < clarus_device_count(device) ? device->profiles[index].selector.c_str() : nullptr;
}

clarus_status clarus_device_read_profile(const clarus_device* device, size_t index, clarus_device_profile* profile) {
    return guarded([&] {
        const std::vector<clarus::DeviceProfile>& profiles = given(device, "device").profiles;
        if (index >= profiles.size())
            clarus::fail(clarus::ErrorKind::invalid_argument, "index {}: there are {} devices", index, profiles.size());
        const clarus::DeviceProfile& from = profiles[index];
        clarus_device_profile read{};
        const size_t size = given(profile, "profile").struct_size;
        if (size < sizeof size)
            clarus::fail(clarus::ErrorKind::invalid_argument, "profile.struct_size is {}; set it to its size", size);
        read.selector = from.selector.c_str();
        read.name = from.name.c_str();
        read.vendor = from.vendor.c_str();
        read.platform = from.platform.c_str();
        read.driver_version = from.driver_version.c_str();
        read.opencl_version = from.opencl_version.c_str();
        read.device_class = static_cast<clarus_device_class>(from.device_class);
        read.simulator = from.simulator;
        read.compute_units = from.compute_units;
        read.clock_mhz = from.clock_mhz;
        read.float_vector_width = from.float_vector_width;
        read.max_work_group_size = from.max_work_group_size;
        read.global_memory = from.global_memory;
        read.max_allocation = from.max_allocation;
        read.local_memory = from.local_memory;
        read.memory_alignment = from.memory_alignment;
        read.local_memory_is_dedicated = from.local_memory_is_dedicated;
        read.unified_memory = from.unified_memory;
        read.images = from.images;
        read.half_storage = from.half_storage;
        read.half_arithmetic = from.half_arithmetic;
        read.int8_dot_product = from.int8_dot_product;
        read.vnni = from.vnni;
        read.fast_fma = from.fast_fma;
        read.subgroups = from.subgroups;
        read.sub_devices = from.sub_devices;
        read.gl_sharing = from.gl_sharing;
        read.external_memory = from.external_memory;
        read.bf16 = from.bf16;
        set_usual(profile, read, size);
    });
}

int clarus_device_is_one_context(const clarus_device* device) { return device && device->device.is_one_context(); }

int clarus_device_programs_compiled(const clarus_device* device) {
    return device ? device->device.programs_compiled() : 0;
}

void clarus_device_release(clarus_device* device) { delete device; }

clarus_status clarus_list_devices(clarus_list** selectors) {
    return list_of(selectors, [] {
        std::vector<std::string> words;
        for (const clarus::DeviceProfile& profile : clarus::list_devices()) words.push_back(profile.selector);
        return words;
    });
}

const char* clarus_cache_directory(void) {
    thread_local std::string folder;
    folder = clarus::cache_directory();
    return folder.c_str();
}

}  // extern "C"
