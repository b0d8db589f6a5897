#pragma once

#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "metrics/quality.h"

namespace clarus::cli {

/// "PSNR 31.20 dB (pooled 31.02 dB), SSIM 0.9312, IF-SSIM 0.9704": the figures that there are.
std::string to_text(const metrics::SequenceQuality& quality);

/// {"psnr": …, "ssim": …, "if_ssim": …, "flip": …}, without what there is not.
nlohmann::ordered_json quality_json(const metrics::FrameQuality& quality);

/// The same, with "pooled_psnr" and "pixel_std".
nlohmann::ordered_json quality_json(const metrics::SequenceQuality& quality);

struct NamedQuality {
    std::string name;
    metrics::SequenceQuality quality;
};

/// A row a result, a column a figure that any of them has. `emphasise`: the best of each column in bold, by a
/// terminal's escape sequences.
std::string quality_table(std::span<const NamedQuality> results, bool emphasise);

/// RFC 4180, every figure a column, with all digits; empty where there is none.
std::string quality_csv(std::span<const NamedQuality> results);

}  // namespace clarus::cli
