#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "metrics/quality.h"

namespace clarus::cli {

/// "PSNR 31.20 dB (pooled 31.02 dB), SSIM 0.9312".
std::string to_text(const metrics::SequenceQuality& quality);

/// {"psnr": …, "ssim": …}; ssim is null where there is none.
nlohmann::ordered_json quality_json(const metrics::FrameQuality& quality);

/// The same, with "pooled_psnr".
nlohmann::ordered_json quality_json(const metrics::SequenceQuality& quality);

}  // namespace clarus::cli
