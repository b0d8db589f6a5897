#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "clarus/types.h"
#include "io/image.h"

namespace clarus::metrics {

/// Windows' similarity, the mean over the channels, row by row; the window of (0, 0) has its centre at the pixel
/// (margin, margin).
struct SsimMap {
    static constexpr int margin = 5;

    Size size;
    std::vector<double> values;

    double mean() const;
};

/// Structural similarity (Wang et al. 2004; docs/metrics.md, "Whole frames") of display values: 11×11 Gaussian windows
/// with σ = 1.5 that fit inside the image, K₁ = 0.01, K₂ = 0.03. None for an image that no window fits into. Errors: as
/// mean_squared_error.
std::optional<SsimMap> ssim_map(const io::Pixels& image, const io::Pixels& reference);

/// The map's mean.
std::optional<double> ssim(const io::Pixels& image, const io::Pixels& reference);

}  // namespace clarus::metrics
