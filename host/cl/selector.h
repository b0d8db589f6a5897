#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "cl/platforms.h"

namespace clarus::ocl {

/// A device that a selector means, in the forms that Device::open documents. Where several fit, a GPU goes before a
/// DSP before a CPU, then more compute units before fewer, then the order of places. Errors: no_device, listing what
/// there is; invalid_argument for a sub-device that the device cannot be parted into.
struct SelectedDevice {
    cl::Device device;
    std::string selector;                 // that selects this one again
    std::optional<DeviceClass> taken_as;  // the class that it is to be treated as, where the selector says one
};

/// One device for each of the selectors between commas. Sub-devices of one device are different parts of it. Errors: as
/// above, and invalid_argument for a device that is named twice.
std::vector<SelectedDevice> select_devices(std::string_view selectors);

}  // namespace clarus::ocl
