#pragma once

#include <nlohmann/json.hpp>

#include "clarus/device.h"

namespace clarus::measure {

/// Sizes in bytes.
nlohmann::ordered_json to_json(const DeviceProfile& device);

}  // namespace clarus::measure
