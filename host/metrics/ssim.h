#pragma once

#include <optional>

#include "io/image.h"

namespace clarus::metrics {

/// Structural similarity (Wang et al. 2004; spec/metrics.md): 11×11 Gaussian windows with σ = 1.5 that fit inside the
/// image, K₁ = 0.01, K₂ = 0.03, mean over windows and the three channels of display values. None for an image that no
/// window fits into. Errors: as mean_squared_error.
std::optional<double> ssim(const io::Pixels& image, const io::Pixels& reference);

}  // namespace clarus::metrics
