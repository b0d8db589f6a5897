#pragma once

#include "io/image.h"

namespace clarus::metrics {

/// Over all pixels and the three channels of two images of display values (metrics/display.h). Errors: invalid_argument
/// where the images differ in size or have not three channels.
double mean_squared_error(const io::Pixels& image, const io::Pixels& reference);

/// 10·log₁₀(1/mse) in dB, at most 100.
double psnr(double mean_squared_error);

}  // namespace clarus::metrics
