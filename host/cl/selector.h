#pragma once

#include <string_view>

#include "cl/platforms.h"

namespace clarus::ocl {

/// The device that `selector` means, in the forms that Device::open documents. Where several fit, a GPU goes before a
/// DSP before a CPU, then more compute units before fewer, then the order of places. Errors: no_device, listing what
/// there is; invalid_argument for a sub-device that the device cannot be parted into.
struct SelectedDevice {
    cl::Device device;
    std::string selector;  // that selects this one again
};
SelectedDevice select_device(std::string_view selector);

}  // namespace clarus::ocl
