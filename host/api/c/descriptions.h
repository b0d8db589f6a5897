#pragma once

#include "clarus/clarus.h"
#include "clarus/upscaler.h"

namespace clarus::c {

/// As C++ has them; null stands for the usual options. Errors: invalid_argument, where a list is null that has a
/// length, a pipeline's option has no name, or something is set that this library does not know.
UpscalerOptions options_from(const clarus_options* options);

/// As C++ has it. Errors: invalid_argument, likewise, and where an event is null.
FrameDescription frame_from(const clarus_frame& frame);

}  // namespace clarus::c
