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
    double period = 0;          // seconds from frame to frame, where each is enqueued before the last is done; median
    double period_ratio = 1;    // over that of all on device 0, measured in turns with it; median
    double together_ratio = 1;  // the same over all frames of so many streams at once, over one of all on device 0
    double fairness = 1;        // of streams that begin together with as many frames: seconds of the first that is done
                                // over those of the last
    std::vector<StageProfile> stages;  // of a run of its own; empty unless asked for
};

struct PlacementOptions {
    bool every_cut = false;  // each cut into the first stages on device 0 and the others on device 1, or the other way
    std::string rules;       // one more placement, by rules (docs/devices.md); empty: none
    int turns = 7;           // of each
    int streams = 1;         // at once; with 1 no more is measured
    bool profiles = false;   // with stages
};

/// Measures all on each device, what "auto" chooses, and what the options say. `progress` is called with 0…1. Errors:
/// those of Upscaler; invalid_argument where there is one device.
std::vector<PlacementResult> measure_placements(const Device& devices, const Model& model, Size render,
                                                const PlacementOptions& options,
                                                const std::function<void(double)>& progress);

}  // namespace clarus::measure
