#pragma once

#include <vector>

#include "clarus/device.h"
#include "graph/traits.h"
#include "runtime/implementation.h"

namespace clarus::runtime {

/// Desktops reset a GPU that works on one launch for seconds, and are not drawn for as long as it does.
constexpr double kLongestLaunch = 0.1;  // seconds

/// Seconds that a device of this profile may take for all of it, estimated from its compute units and clock for the
/// slowest that there are: not what it does take, which is less.
double most_seconds(const Problem& problem, const DeviceProfile& profile);

/// What a call is launched for, one after the other: all its rows, or on GPUs some of them at a time, so that no launch
/// takes longer than kLongestLaunch. `seconds`: most_seconds of all of `rows`, which begin where a work-group does.
std::vector<graph::Rows> short_launches(const KernelCall& call, graph::Rows rows, double seconds,
                                        const DeviceProfile& profile);

/// All rows of a call's result, rounded up to what its work-items make.
graph::Rows rows_of(const KernelCall& call);

}  // namespace clarus::runtime
