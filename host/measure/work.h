#pragma once

#include <functional>
#include <string>
#include <vector>

#include "clarus/device.h"

namespace clarus::measure {

/// Something to be timed. `run` does it once and returns the seconds that the device took.
struct Work {
    std::string name;
    double operations = 0;
    double bytes = 0;
    std::function<double()> run;
};

/// Multiply–adds: a sweep over vector widths and accumulators.
std::vector<Work> peak_sweep(const Device& device);

/// Multiply–adds of bytes: a sweep over accumulators. Empty where the device has no instruction for them that is used
/// (DeviceProfile::vnni): then bytes are multiplied as floats, or 16-bit numbers.
std::vector<Work> int8_peak_sweep(const Device& device);

/// One large copy, counting bytes read and written.
Work copy_work(const Device& device);

/// The one of them that makes the most operations a second, each run a few times in turn with the others.
struct Most {
    Work work;
    double operations_a_second = 0;
};
Most most_operations(const std::vector<Work>& works);

}  // namespace clarus::measure
