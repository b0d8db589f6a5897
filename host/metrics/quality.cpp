#include "metrics/quality.h"

#include <algorithm>
#include <vector>

#include "base/error.h"
#include "metrics/psnr.h"
#include "metrics/ssim.h"

namespace clarus::metrics {
namespace {

/// A frame moves where this share of its pixels does.
constexpr double moving_share = 0.1;

/// Over the frames that have the figure, which must be `least` of them.
template <typename FigureOf>
std::optional<double> mean(std::span<const FrameQuality> frames, size_t least, FigureOf&& figure_of) {
    double sum = 0;
    size_t count = 0;
    for (const FrameQuality& frame : frames) {
        const std::optional<double> figure = figure_of(frame);
        sum += figure.value_or(0);
        count += figure.has_value();
    }
    if (count < least) return std::nullopt;
    return sum / static_cast<double>(count);
}

std::optional<RegionQuality> mean_region(std::span<const FrameQuality> frames, size_t region) {
    const auto psnr_of = [region](const FrameQuality& frame) {
        const auto& quality = frame.regions[region];
        return quality ? std::optional(quality->psnr) : std::nullopt;
    };
    const auto ssim_of = [region](const FrameQuality& frame) {
        const auto& quality = frame.regions[region];
        return quality ? quality->ssim : std::nullopt;
    };
    const std::optional<double> psnr = mean(frames, 1, psnr_of);
    if (!psnr) return std::nullopt;
    return RegionQuality{*psnr, mean(frames, 1, ssim_of)};
}

std::optional<RadianceQuality> mean_radiance(std::span<const FrameQuality> frames) {
    if (!std::ranges::all_of(frames, [](const FrameQuality& frame) { return frame.radiance.has_value(); }))
        return std::nullopt;
    const auto mean_of = [&](auto&& figure) {
        return mean(frames, 1, [&](const FrameQuality& frame) { return std::optional((*frame.radiance).*figure); });
    };
    return RadianceQuality{mean(frames, 1, [](const FrameQuality& frame) { return frame.radiance->mean_ratio; }),
                           *mean_of(&RadianceQuality::relative_error), *mean_of(&RadianceQuality::pq_psnr)};
}

}  // namespace

FrameQuality measure(const io::Pixels& image, const io::Pixels& reference, const Masks* masks) {
    FrameQuality quality;
    quality.mean_squared_error = mean_squared_error(image, reference);
    quality.psnr = psnr(quality.mean_squared_error);
    quality.blocks = block_errors(image, reference);
    const std::optional<SsimMap> map = ssim_map(image, reference);
    if (map) quality.ssim = map->mean();
    if (!masks) return quality;
    for (size_t i = 0; i < region_count; ++i)
        quality.regions[i] = measure_region(image, reference, map, masks->masks[i]);
    const Mask& moving = (*masks)[Region::moving];
    quality.moves =
        static_cast<double>(std::ranges::count(moving, 1)) >= moving_share * static_cast<double>(moving.size());
    return quality;
}

void compare_blocks(std::span<FrameQuality> frames, std::span<const FrameQuality> baseline) {
    if (frames.size() != baseline.size())
        fail(ErrorKind::invalid_argument, "{} frames cannot be compared with a baseline of {}", frames.size(),
             baseline.size());
    for (size_t i = 0; i < frames.size(); ++i)
        frames[i].worse_blocks = share_worse(frames[i].blocks, baseline[i].blocks);
}

SequenceQuality summarise(std::span<const FrameQuality> frames) {
    if (frames.empty()) fail(ErrorKind::invalid_argument, "a sequence without frames has no quality");

    double error = 0, mean_psnr = 0;
    std::vector<double> blocks;
    for (const FrameQuality& frame : frames) {
        error += frame.mean_squared_error;
        mean_psnr += frame.psnr;
        const std::vector<double>& errors = frame.blocks.mean_squared_errors;
        blocks.insert(blocks.end(), errors.begin(), errors.end());
    }
    const double count = static_cast<double>(frames.size());
    const auto mean_of = [&](std::optional<double> FrameQuality::*figure, size_t least) {
        return mean(frames, least, [figure](const FrameQuality& frame) { return frame.*figure; });
    };
    SequenceQuality quality;
    quality.psnr = mean_psnr / count;
    quality.pooled_psnr = psnr(error / count);
    quality.ssim = mean_of(&FrameQuality::ssim, frames.size());
    quality.if_ssim = mean_of(&FrameQuality::if_ssim, 1);
    quality.flip = mean_of(&FrameQuality::flip, frames.size());
    quality.lpips = mean_of(&FrameQuality::lpips, frames.size());
    quality.vmaf = mean_of(&FrameQuality::vmaf, frames.size());
    quality.srred = mean_of(&FrameQuality::srred, 1);
    quality.trred = mean_of(&FrameQuality::trred, 1);
    if (quality.srred && quality.trred) quality.strred = *quality.srred * *quality.trred;
    for (size_t i = 0; i < region_count; ++i) quality.regions[i] = mean_region(frames, i);
    if (!blocks.empty()) quality.worst_blocks_psnr = psnr(worst_hundredth(std::move(blocks)));
    quality.worse_blocks = mean_of(&FrameQuality::worse_blocks, 1);
    quality.worse_blocks_moving =
        mean(frames, 1, [](const FrameQuality& frame) { return frame.moves ? frame.worse_blocks : std::nullopt; });
    quality.radiance = mean_radiance(frames);
    return quality;
}

}  // namespace clarus::metrics
