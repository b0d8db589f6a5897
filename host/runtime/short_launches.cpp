#include "runtime/short_launches.h"

#include <algorithm>
#include <cmath>

#include "base/rounding.h"

namespace clarus::runtime {
namespace {

// A quarter of what a compute unit of sixteen operations a clock would do; few GPUs have narrower ones. Memory is at
// least as fast as that of phones.
constexpr double kOperationsAClock = 4;
constexpr double kBytesASecond = 8e9;
constexpr int kUnknownClock = 500;  // MHz, where the driver tells none

}  // namespace

double most_seconds(const Problem& problem, const DeviceProfile& profile) {
    const double clock = 1e6 * (profile.clock_mhz > 0 ? profile.clock_mhz : kUnknownClock);
    const double rate = std::max(1, profile.compute_units) * clock * kOperationsAClock;
    return std::max(problem.operations / rate, problem.bytes / kBytesASecond);
}

graph::Rows rows_of(const KernelCall& call) {
    return {0, static_cast<int>(call.global[call.row_axis]) * call.rows_an_item};
}

std::vector<graph::Rows> short_launches(const KernelCall& call, graph::Rows rows, double seconds,
                                        const DeviceProfile& profile) {
    if (profile.device_class != DeviceClass::gpu || seconds <= kLongestLaunch) return {rows};
    const int group = static_cast<int>(call.local[call.row_axis]) * call.rows_an_item;
    const double pieces = std::ceil(seconds / kLongestLaunch);
    const int height = std::max(group, static_cast<int>((rows.end - rows.first) / pieces) / group * group);
    std::vector<graph::Rows> result;
    for (int first = rows.first; first < rows.end; first += height)
        result.push_back({first, std::min(first + height, rows.end)});
    return result;
}

}  // namespace clarus::runtime
