#pragma once

#include <functional>
#include <string>
#include <vector>

#include "clarus/device.h"
#include "clarus/model.h"
#include "clarus/upscaler.h"

namespace clarus::measure {

/// How a model runs when its stages are shared out among several devices, with images in host memory.
struct PlacementResult {
    std::string name;               // "all on 0", "auto", "1 from STAGE"
    std::vector<PlacedPart> parts;  // in their order
    double latency = 0;             // seconds of a frame that is alone; median
    double period = 0;        // seconds from frame to frame, where each is enqueued before the last is done; median
    double period_ratio = 1;  // over that of all on device 0, measured in turns with it; median
    std::vector<StageProfile> stages;  // of a run of its own; empty unless asked for
};

/// Measures all on each device, what "auto" chooses, and, where `every_cut`, each cut into the first stages on device 0
/// and the others on device 1, or the other way round. `turns`: of each. `profiles`: with stages. `progress` is called
/// with 0…1. Errors: those of Upscaler; invalid_argument where there is one device.
std::vector<PlacementResult> measure_placements(const Device& devices, const Model& model, Size render, bool every_cut,
                                                int turns, bool profiles, const std::function<void(double)>& progress);

}  // namespace clarus::measure
