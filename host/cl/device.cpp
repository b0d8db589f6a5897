#include "clarus/device.h"

#include <algorithm>

#include "base/log.h"
#include "cl/context.h"
#include "cl/error.h"
#include "cl/platforms.h"
#include "cl/profile.h"
#include "cl/selector.h"

namespace clarus {

std::vector<DeviceProfile> list_devices() {
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

Device Device::open(std::string_view selector) {
    const ocl::SelectedDevice selected = ocl::select_device(selector);
    return ocl::checked(fmt::format("open the device '{}'", selector), [&] {
        return Device(
            std::make_shared<ocl::Context>(selected.device, ocl::profile_of(selected.device, selected.selector)));
    });
}

Device Device::adopt(cl_context context, cl_device_id device, cl_command_queue queue) {
    if (!context || !device || !queue)
        fail(ErrorKind::invalid_argument,
             "adopting a device takes a context, a device and a queue; one of them is null");
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
        return Device(std::make_shared<ocl::Context>(cl::Context(context, true), adopted, adopted_queue,
                                                     ocl::profile_of(adopted, selector)));
    });
}

const DeviceProfile& Device::profile() const { return context_->profile(); }

int Device::programs_compiled() const { return context_->programs_compiled(); }

}  // namespace clarus
