#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <span>

namespace clarus::cli {

/// What a report's timeline shows of Chrome traces (`--trace` of render, play, serve and upscale): of the frames that
/// most processes had a part in, a few in the middle. The traces are of one run and are laid on one clock, by the
/// "began" of their "otherData". {"label", "lanes": [text], "spans": [{"name", "frame": from 0 on, "label": the frame's
/// name, "lane": its index, "start", "end": seconds}]}, in the order of starts. Errors: file, for what is no such
/// trace, or where no frame is in them.
nlohmann::ordered_json timeline_of_traces(std::span<const std::filesystem::path> files);

}  // namespace clarus::cli
