#pragma once

#include <vector>

#include "clarus/device.h"
#include "runtime/layout.h"

namespace clarus::runtime {

/// Rows [first, end) of a value's image.
struct Band {
    graph::Value value;
    int first, end;
};

/// Neighbouring nodes that work on bands of rows, one after the other, from the top of the image to its bottom. Of an
/// image that only they use, no more rows are kept than one of them still reads (TensorLayout::ring), whatever the
/// image's height: nothing is computed twice.
struct BandedNodes {
    graph::Value first, last;
    std::vector<Band> order;
};

/// Bands of every image begin at multiples of so many rows, so that work-groups do, whose heights divide it. The fewer,
/// the less is kept of small images.
int band_granule(const DeviceProfile& profile);

/// Finds nodes whose images would be large on the device and makes them work on bands of `rows` rows of their largest
/// image, rounded up; for 0, of the built-in number. Lays out rings in `plan`.
std::vector<BandedNodes> plan_bands(LayoutPlan& plan, int rows, const DeviceProfile& profile);

}  // namespace clarus::runtime
