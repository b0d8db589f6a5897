#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "io/frames.h"
#include "io/image.h"

namespace clarus::metrics {

/// The places where figures are taken, besides whole frames; docs/metrics.md, "Masks", defines them.
enum class Region { disoccluded_1, disoccluded_4, disoccluded_8, thin, moving, still };
constexpr size_t region_count = 6;
constexpr std::array<const char*, region_count> region_names{"disoccluded_1", "disoccluded_4", "disoccluded_8",
                                                             "thin",          "moving",        "still"};

/// Of an image's pixels, row by row: 1 inside, else 0.
using Mask = std::vector<uint8_t>;

struct Masks {
    std::array<Mask, region_count> masks;

    const Mask& operator[](Region region) const { return masks[static_cast<size_t>(region)]; }
    Mask& operator[](Region region) { return masks[static_cast<size_t>(region)]; }
};

/// Makes every frame's masks from depth and motion at the centres of output pixels: frames come one by one, and how
/// long ago each pixel's surface came into sight is carried along the motion.
class MaskMaker {
  public:
    /// `scale`: output pixels a render pixel.
    explicit MaskMaker(double scale) : scale_(scale) {}

    /// `follows`: the frame added before is the one before this, without a cut between. Otherwise nothing is known of
    /// what was, and only `thin` has pixels. Errors: invalid_argument where sizes differ, or from the frame before.
    Masks add(const io::GroundTruth& truth, bool follows);

  private:
    /// When what is near a pixel's centre was last hidden, and where exactly that is: pixels move by fractions, and
    /// whole pixels alone would lag behind.
    struct Sight {
        uint8_t age;         // in frames, 0 for what was hidden in the frame before
        float x = 0, y = 0;  // from the pixel's centre
    };

    Sight followed(const io::GroundTruth& truth, int x, int y, float depth_shift) const;

    double scale_;
    io::Pixels previous_depth_;
    std::vector<Sight> sights_;
};

/// Of the pixels narrower than two render pixels, and their neighbours. `depth` is canonical, of output pixels.
Mask thin_mask(const io::Pixels& depth, double scale);

}  // namespace clarus::metrics
