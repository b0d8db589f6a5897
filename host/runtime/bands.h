#pragma once

#include <vector>

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

/// Rows of bands begin at multiples of this many: the kernels' work-groups must not begin between them.
inline constexpr int kBandGranule = 8;

/// Finds nodes whose images would be large and makes them work on bands of `rows` rows of their largest image, rounded
/// up; for 0, of as many as suit their size. Lays out rings in `plan`.
std::vector<BandedNodes> plan_bands(LayoutPlan& plan, int rows);

}  // namespace clarus::runtime
