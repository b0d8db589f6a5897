#pragma once

#include <nlohmann/json.hpp>
#include <span>

#include "clarus/stream.h"

namespace clarus::measure {

// How `clarus upscale --report` writes where and when stages ran. Times in seconds, sizes in bytes.

nlohmann::ordered_json placement_json(std::span<const PlacedPart> placement);

/// Without spans.
nlohmann::ordered_json stages_json(std::span<const StageProfile> stages);

/// The spans of a few frames in the middle of those that were profiled: [{"stage": its index, "frame", "start",
/// "end"}], from the first on and in the order of starts.
nlohmann::ordered_json timeline_json(std::span<const StageProfile> stages);

}  // namespace clarus::measure
