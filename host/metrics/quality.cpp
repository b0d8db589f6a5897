#include "metrics/quality.h"

#include "base/error.h"
#include "metrics/psnr.h"
#include "metrics/ssim.h"

namespace clarus::metrics {
namespace {

/// Over the frames that have the figure, which must be `least` of them.
std::optional<double> mean(std::span<const FrameQuality> frames, std::optional<double> FrameQuality::*figure,
                           size_t least) {
    double sum = 0;
    size_t count = 0;
    for (const FrameQuality& frame : frames) {
        sum += (frame.*figure).value_or(0);
        count += (frame.*figure).has_value();
    }
    if (count < least) return std::nullopt;
    return sum / static_cast<double>(count);
}

}  // namespace

FrameQuality measure(const io::Pixels& image, const io::Pixels& reference) {
    const double error = mean_squared_error(image, reference);
    return {
        .mean_squared_error = error, .psnr = psnr(error), .ssim = ssim(image, reference), .if_ssim = {}, .flip = {}};
}

SequenceQuality summarise(std::span<const FrameQuality> frames) {
    if (frames.empty()) fail(ErrorKind::invalid_argument, "a sequence without frames has no quality");

    double error = 0, mean_psnr = 0;
    for (const FrameQuality& frame : frames) {
        error += frame.mean_squared_error;
        mean_psnr += frame.psnr;
    }
    const double count = static_cast<double>(frames.size());
    return {.psnr = mean_psnr / count,
            .pooled_psnr = psnr(error / count),
            .ssim = mean(frames, &FrameQuality::ssim, frames.size()),
            .if_ssim = mean(frames, &FrameQuality::if_ssim, 1),
            .flip = mean(frames, &FrameQuality::flip, frames.size()),
            .pixel_std = {}};
}

}  // namespace clarus::metrics
