#include "metrics/quality.h"

#include "base/error.h"
#include "metrics/psnr.h"
#include "metrics/ssim.h"

namespace clarus::metrics {

FrameQuality measure(const io::Pixels& image, const io::Pixels& reference) {
    const double error = mean_squared_error(image, reference);
    return {error, psnr(error), ssim(image, reference)};
}

SequenceQuality summarise(std::span<const FrameQuality> frames) {
    if (frames.empty()) fail(ErrorKind::invalid_argument, "a sequence without frames has no quality");

    double error = 0, mean_psnr = 0, mean_ssim = 0;
    bool has_ssim = true;
    for (const FrameQuality& frame : frames) {
        error += frame.mean_squared_error;
        mean_psnr += frame.psnr;
        mean_ssim += frame.ssim.value_or(0);
        has_ssim = has_ssim && frame.ssim;
    }
    const double count = static_cast<double>(frames.size());
    SequenceQuality quality{mean_psnr / count, psnr(error / count), std::nullopt};
    if (has_ssim) quality.ssim = mean_ssim / count;
    return quality;
}

}  // namespace clarus::metrics
