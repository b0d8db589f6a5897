#pragma once

#include <optional>

#include "io/image.h"
#include "metrics/masks.h"
#include "metrics/ssim.h"

namespace clarus::metrics {

/// Quality of an image's pixels inside a mask.
struct RegionQuality {
    double psnr = 0;             // dB, of the mean squared error over them
    std::optional<double> ssim;  // the map's mean over those that are a window's centre; none where none is
};

/// None for a mask of fewer than 64 pixels. `map` is that of the two images, where they have one. Errors:
/// invalid_argument unless the images can be compared and the mask is of their size.
std::optional<RegionQuality> measure_region(const io::Pixels& image, const io::Pixels& reference,
                                            const std::optional<SsimMap>& map, const Mask& mask);

}  // namespace clarus::metrics
