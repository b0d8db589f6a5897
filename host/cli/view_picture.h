#pragma once

#include "clarus/upscaler.h"
#include "io/image.h"

namespace clarus::cli {

/// A view as a picture to look at, enlarged to `size` by nearest where it is smaller. One channel: grey, as it is where
/// it stays in [0, 1], else from its least to its largest value. Two: motion as a colour wheel, hue for direction and
/// saturation for length relative to the longest. Three: red, green and blue. More, or several maps: a sheet of all
/// channels, small and in grey, row by row, all from the least to the largest value of any.
io::Pixels view_picture(const Upscaler::View& view, Size size);

}  // namespace clarus::cli
