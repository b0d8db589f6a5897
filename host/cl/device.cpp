#include "clarus/device.h"

#include <algorithm>
#include <map>
#include <mutex>

#include "base/log.h"
#include "cl/context.h"
#include "cl/error.h"
#include "cl/platforms.h"
#include "cl/profile.h"
#include "cl/selector.h"

namespace clarus {

namespace {

/// Drivers and the loader prepare themselves at the first call, and some do so badly on several threads at once.
std::recursive_mutex& first_calls() {
    static std::recursive_mutex instance;
    return instance;
}

}  // namespace

std::vector<DeviceProfile> list_devices() {
    const std::lock_guard lock(first_calls());
    std::vector<DeviceProfile> profiles;
    for (const ocl::PlacedDevice& placed : ocl::placed_devices()) {
        try {
            profiles.push_back(ocl::profile_of(placed.device, placed.selector()));
        } catch (const cl::Error& error) {
            log(LogLevel::debug, "device {} is passed over: {} says {}", placed.selector(), error.what(),
                ocl::status_name(error.err()));
        }
    }
    return profiles;
}

namespace {

/// Of a device that is to be treated as one of another class, with that class's limits.
DeviceProfile profile_as(const ocl::SelectedDevice& selected) {
    DeviceProfile profile = ocl::profile_of(selected.device, selected.selector);
    if (!selected.taken_as) return profile;
    profile.device_class = *selected.taken_as;
    if (profile.device_class == DeviceClass::dsp) profile.images = false;
    return profile;
}

}  // namespace

Device Device::open(std::string_view selector) {
    const std::lock_guard lock(first_calls());
    const std::vector<ocl::SelectedDevice> selected = ocl::select_devices(selector);
    return ocl::checked(fmt::format("open the device '{}'", selector), [&] {
        std::map<cl_platform_id, std::vector<cl::Device>> platforms;
        for (const ocl::SelectedDevice& each : selected)
            platforms[each.device.getInfo<CL_DEVICE_PLATFORM>()].push_back(each.device);
        std::map<cl_platform_id, cl::Context> contexts;
        for (const auto& [platform, devices] : platforms) contexts[platform] = cl::Context(devices);
        std::vector<std::shared_ptr<ocl::Context>> result;
        for (const ocl::SelectedDevice& each : selected)
            result.push_back(std::make_shared<ocl::Context>(contexts[each.device.getInfo<CL_DEVICE_PLATFORM>()],
                                                            each.device, profile_as(each)));
        return Device(std::move(result));
    });
}

Device Device::adopt(cl_context context, cl_device_id device, cl_command_queue queue) {
    if (!context || !device || !queue)
        fail(ErrorKind::invalid_argument,
             "adopting a device takes a context, a device and a queue; one of them is null");
    const std::lock_guard lock(first_calls());
    return ocl::checked("adopt the caller's device", [&] {
        const cl::Device adopted(device, true);
        const cl::CommandQueue adopted_queue(queue, true);
        if (adopted_queue.getInfo<CL_QUEUE_DEVICE>()() != device ||
            adopted_queue.getInfo<CL_QUEUE_CONTEXT>()() != context)
            fail(ErrorKind::invalid_argument, "the queue to adopt belongs to another device or context");

        // A sub-device, or one that the list leaves out, has no place.
        std::string selector;
        for (const ocl::PlacedDevice& placed : ocl::placed_devices())
            if (placed.device() == device) selector = placed.selector();
        return Device({std::make_shared<ocl::Context>(cl::Context(context, true), adopted, adopted_queue,
                                                      ocl::profile_of(adopted, selector))});
    });
}

Device Device::together(const std::vector<Device>& devices) {
    std::vector<std::shared_ptr<ocl::Context>> contexts;
    for (const Device& device : devices)
        contexts.insert(contexts.end(), device.contexts_.begin(), device.contexts_.end());
    if (contexts.empty()) fail(ErrorKind::invalid_argument, "no device is to work together");
    return Device(std::move(contexts));
}

const DeviceProfile& Device::profile() const { return context().profile(); }

std::vector<DeviceProfile> Device::profiles() const {
    std::vector<DeviceProfile> profiles;
    for (const auto& context : contexts_) profiles.push_back(context->profile());
    return profiles;
}

bool Device::is_one_context() const {
    return std::all_of(contexts_.begin(), contexts_.end(),
                       [&](const auto& each) { return each->shares_memory_with(context()); });
}

int Device::programs_compiled() const {
    int programs = 0;
    for (const auto& context : contexts_) programs += context->programs_compiled();
    return programs;
}

}  // namespace clarus
