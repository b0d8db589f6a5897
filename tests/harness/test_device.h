#pragma once

#include <cstdlib>
#include <string>

#include "clarus/device.h"

/// What CLARUS_TEST_DEVICE names, else "auto".
inline std::string test_selector() {
    const char* selector = std::getenv("CLARUS_TEST_DEVICE");
    return selector ? selector : "auto";
}

/// The device under test, opened once and never closed: at the program's exit the driver may be gone before it.
inline clarus::Device test_device() {
    static const clarus::Device& device = *new clarus::Device(clarus::Device::open(test_selector()));
    return device;
}
