#pragma once

#include <vector>

#include "runtime/bands.h"
#include "runtime/layout.h"

namespace clarus::runtime {

/// Where each memory of a layout plan lies in one arena. Memories that are never needed at the same time share bytes; a
/// state's lifetime crosses the frame's boundary.
struct MemoryPlan {
    struct Place {
        size_t offset = 0;
        size_t bytes = 0;
    };
    std::vector<Place> places;     // one a memory
    std::vector<bool> alternates;  // one a state: its two memories change roles every frame; else they are one
    size_t bytes = 0;              // the arena's size
    /// The most that the values needed at one moment take, without padding: the floor for `bytes`. What is concatenated
    /// in one memory counts as a whole, from the first part that is written to the last that is read.
    size_t peak_live_bytes = 0;
};

/// `alignment`: what every offset is a multiple of, in bytes. Inputs are written before the first node runs; the output
/// and views are read after the last. What nodes that work on bands use is needed while any of them runs.
MemoryPlan plan_memory(const LayoutPlan& plan, size_t alignment, const std::vector<BandedNodes>& banded = {});

}  // namespace clarus::runtime
