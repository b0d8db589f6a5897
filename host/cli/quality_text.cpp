#include "cli/quality_text.h"

#include <fmt/format.h>

namespace clarus::cli {
namespace {

nlohmann::ordered_json or_null(const std::optional<double>& value) {
    return value ? nlohmann::ordered_json(*value) : nlohmann::ordered_json();
}

}  // namespace

std::string to_text(const metrics::SequenceQuality& quality) {
    return fmt::format("PSNR {:.2f} dB (pooled {:.2f} dB), SSIM {}", quality.psnr, quality.pooled_psnr,
                       quality.ssim ? fmt::format("{:.4f}", *quality.ssim) : "- (smaller than its window)");
}

nlohmann::ordered_json quality_json(const metrics::FrameQuality& quality) {
    return {{"psnr", quality.psnr}, {"ssim", or_null(quality.ssim)}};
}

nlohmann::ordered_json quality_json(const metrics::SequenceQuality& quality) {
    return {{"psnr", quality.psnr}, {"pooled_psnr", quality.pooled_psnr}, {"ssim", or_null(quality.ssim)}};
}

}  // namespace clarus::cli
