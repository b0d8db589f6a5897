#pragma once

#include <optional>
#include <vector>

#include "io/image.h"

namespace clarus::metrics {

/// Pixel std (Mercier et al. 2023, table 3; docs/metrics.md, "Whole frames") of a result over a sequence's static
/// segments: runs of two or more frames that show nothing new, so without the one that the camera came to rest in. A
/// frame shows nothing new where its reference is, bit for bit, that of the frame before; the sequence's first frame
/// belongs to the segment that begins with its second. Welford's sums: frames come one by one.
class PixelStd {
  public:
    /// The next frame's display values, and whether its reference is that of the frame before. Errors: as
    /// mean_squared_error where the frame's size changes.
    void add(const io::Pixels& frame, bool is_static);

    /// The mean over the static segments; none where there is none.
    std::optional<double> mean() const;

  private:
    std::optional<double> of_segment() const;

    bool is_first_ = true;
    size_t count_ = 0;                     // frames in the segment that may still grow
    std::vector<double> means_, squares_;  // of its values; sums of their squared deviations
    std::vector<double> closed_;           // earlier segments' figures
};

}  // namespace clarus::metrics
