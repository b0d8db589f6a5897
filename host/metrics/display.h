#pragma once

#include "clarus/stream.h"
#include "io/image.h"

namespace clarus::metrics {

/// The first three channels as the display values in [0, 1] that metrics compare (docs/conventions.md, "Colour"): srgb
/// is clamped, with NaN as 0; linear HDR is exposed, tone-mapped and encoded. Errors: invalid_argument for fewer
/// channels.
io::Pixels display_values(const io::Pixels& pixels, ColorSpace color_space, float exposure = 1);

/// The first three channels of linear HDR as radiance from 0, times exposure: as display_values sees it before it is
/// tone-mapped. Errors: as display_values.
io::Pixels exposed_radiance(const io::Pixels& pixels, float exposure);

/// Errors: invalid_argument, saying why the two cannot be compared, unless both are of one size with three channels.
void require_comparable(const io::Pixels& image, const io::Pixels& reference);

}  // namespace clarus::metrics
