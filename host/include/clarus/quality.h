#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "clarus/export.h"
#include "clarus/types.h"

/// What an engine sets up before it makes an upscaler (docs/integrating.md, "Quality modes").
namespace clarus {

/// "ultra_quality", "quality", "balanced", "performance", "ultra_performance": from the least to the largest scale.
CLARUS_API std::vector<std::string> quality_modes();

/// Output over render size, along each axis. Errors: invalid_argument for what is no mode, naming those there are.
CLARUS_API double quality_scale(std::string_view mode);

/// What to render for an output of this size: its sides over `scale`, rounded to the nearest, at least 1. Errors:
/// invalid_argument for a side below 1 or a scale below 1.
CLARUS_API Size quality_render_size(Size output, double scale);

/// How many points of a jitter sequence give each output pixel eight samples: 8·scale², rounded to the nearest. Errors:
/// invalid_argument for a scale below 1.
CLARUS_API int jitter_count(double scale);

/// To add to the bias of the textures' mip levels: −log₂ scale. Errors: invalid_argument for a scale below 1.
CLARUS_API double mip_bias(double scale);

}  // namespace clarus
