#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

namespace clarus::report {

/// One HTML file that shows the data and asks the network for nothing, or nothing but its server (report/server.h). All
/// of these may be missing or empty:
///   title     string: of what the report is
///   version   string: of a page that is served, which asks for it to see whether there is another one
///   render_size, output_size  [width, height]
///   frames    [string]: names of all frames that were compared
///   lossless  bool: of the pictures
///   pictured  [index into frames]: of which there are pictures
///   sources   [{"name", "kind": "input" | "result" | "view" | "reference", "size", "images": [data URL]}]: one image
///   each
///             frame that is pictured
///   masks     [{"name", "images": [data URL]}]: one image each frame that is pictured, of output_size, white inside
///   block     the side of a place, in output pixels
///   results   [{"name", "quality": as comparison_json, "run": as `clarus upscale --report` writes, or null,
///             "places": [{"picture": index into pictured, "x", "y", "psnr"}], the worst first}]
///   placements  [{"name", "seconds": from frame to frame, "devices", "placement", "stages", "timeline": as there}]:
///             how several devices shared a model, as `clarus bench placement` measured
///   benches   [{"name", "bench": as `clarus bench` writes}]
///
/// Frames of a result's quality may lack figures, where they are not measured yet. `name`: "check.html" is the page of
/// `clarus check`, whose data are those of cli/check_page.cpp.
std::string page(const nlohmann::ordered_json& data, std::string_view name = "page.html");

}  // namespace clarus::report
