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

/// Whether neighbouring nodes that could work on bands do, and whether their kernels are compiled for rings of rows.
/// Bands need rings; rings alone stand for nodes that would work on bands at 4K, so that the kernels are the same.
struct BandChoice {
    bool in_bands = false, for_rings = false;
};

struct BandPlan {
    std::vector<BandedNodes> banded;
    std::vector<BandChoice> choices;  // of all neighbouring nodes that could, in their order
};

/// Finds nodes whose images would be large on the device and makes them work on bands of `rows` rows of their largest
/// image, rounded up; for 0, of the built-in number. Lays out rings in `plan`. `choices`: in place of what the sizes
/// say, those of a plan of the same network at another size.
BandPlan plan_bands(LayoutPlan& plan, int rows, const DeviceProfile& profile,
                    const std::vector<BandChoice>& choices = {});

}  // namespace clarus::runtime
