#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "io/frames.h"
#include "io/image.h"

namespace clarus::metrics {

/// Two consecutive frames as IF-SSIM sees them (Yang et al. 2022, section 4; docs/metrics.md, "Whole frames"): where
/// each pixel was, and which of them must look the same. Made once for all results that are measured on these frames.
/// What it leaves open: the 5×5 window repeats the image's edge, odd sizes lose their last row or column
/// to the pooling, and a pixel whose motion is invalid passes no test. A frame after a cut (`reset`) has no predecessor
/// to be compared with.
class InterFrame {
  public:
    /// References are display values; all images are of one size, and `truth` must outlive this. Errors:
    /// invalid_argument.
    InterFrame(const io::Pixels& previous_reference, const io::Pixels& previous_depth, const io::Pixels& reference,
               const io::GroundTruth& truth);

    /// SSIM of the aligned, pooled and masked frames of a result's display values; none where they are smaller than its
    /// window. Errors: as mean_squared_error.
    std::optional<double> ssim(const io::Pixels& previous, const io::Pixels& current) const;

    /// Of the pooled pixels, row by row: 1 where all four pixels pass both tests, else 0.
    const std::vector<uint8_t>& mask() const { return mask_; }

  private:
    const io::Pixels& motion_;
    std::vector<uint8_t> mask_;
};

/// f of IF-SSIM: the least change of a channel that shows, at a mean brightness; both in 8-bit levels.
double visible_difference(double brightness);

}  // namespace clarus::metrics
