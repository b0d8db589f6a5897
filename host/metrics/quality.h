#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>

#include "io/image.h"
#include "metrics/blocks.h"
#include "metrics/masks.h"
#include "metrics/radiance.h"
#include "metrics/regions.h"

namespace clarus::metrics {

/// By Region; none where a mask is too small, or there are no masks.
using RegionQualities = std::array<std::optional<RegionQuality>, region_count>;

struct FrameQuality {
    double mean_squared_error = 0;
    double psnr = 0;                // dB
    std::optional<double> ssim;     // none for an image smaller than its window
    std::optional<double> if_ssim;  // with the frame before; none on a first frame, or without ground truth
    std::optional<double> flip;     // only where asked for
    std::optional<double> lpips;    // likewise
    std::optional<double> vmaf;     // likewise
    std::optional<double> srred;    // STRRED's spatial part; none for small images
    std::optional<double> trred;    // its temporal part, besides none without a frame before
    BlockErrors blocks;
    std::optional<double> worse_blocks;  // share of them that are worse than a baseline's; none without one
    RegionQualities regions;
    bool moves = false;                       // a moving frame; not without masks
    std::optional<RadianceQuality> radiance;  // of linear sequences; left to who sees the images
};

/// PSNR and SSIM of display values, of the whole, of blocks and, where there are masks, inside of them. Errors: as
/// mean_squared_error.
FrameQuality measure(const io::Pixels& image, const io::Pixels& reference, const Masks* masks = nullptr);

/// Sets `worse_blocks` of frames that are the baseline's, one by one. Errors: invalid_argument where they are not.
void compare_blocks(std::span<FrameQuality> frames, std::span<const FrameQuality> baseline);

struct SequenceQuality {
    double psnr = 0;                            // mean of the frames'
    double pooled_psnr = 0;                     // of the mean squared error over all frames
    std::optional<double> ssim, if_ssim, flip;  // means: of SSIM and FLIP only where every frame has one
    std::optional<double> lpips, vmaf;          // as FLIP
    std::optional<double> srred, trred;         // means over the frames that have one
    std::optional<double> strred;               // their product
    std::optional<double> pixel_std;            // 8-bit levels; left to who sees the images
    RegionQualities regions;                    // means over the frames that have one
    std::optional<double> worst_blocks_psnr;    // of the worst hundredth of all frames' blocks together
    std::optional<double> worse_blocks;         // share of all frames' blocks
    std::optional<RadianceQuality> radiance;    // means, of frames that all have one
    std::optional<double> worse_blocks_moving;  // of moving frames' blocks
};

/// Errors: invalid_argument where there is no frame.
SequenceQuality summarise(std::span<const FrameQuality> frames);

}  // namespace clarus::metrics
