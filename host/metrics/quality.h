#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "io/image.h"

namespace clarus::metrics {

struct FrameQuality {
    double mean_squared_error = 0;
    double psnr = 0;                // dB
    std::optional<double> ssim;     // none for an image smaller than its window
    std::optional<double> if_ssim;  // with the frame before; none on a first frame, or without ground truth
    std::optional<double> flip;     // only where asked for
};

/// PSNR and SSIM of display values. Errors: as mean_squared_error.
FrameQuality measure(const io::Pixels& image, const io::Pixels& reference);

struct SequenceQuality {
    double psnr = 0;                            // mean of the frames'
    double pooled_psnr = 0;                     // of the mean squared error over all frames
    std::optional<double> ssim, if_ssim, flip;  // means: of SSIM and FLIP only where every frame has one
    std::optional<double> pixel_std;            // 8-bit levels; left to who sees the images
};

/// Errors: invalid_argument where there is no frame.
SequenceQuality summarise(std::span<const FrameQuality> frames);

}  // namespace clarus::metrics
