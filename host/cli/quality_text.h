#pragma once

#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "metrics/quality.h"

namespace clarus::cli {

/// "PSNR 31.20 dB (pooled 31.02 dB), SSIM 0.9312, IF-SSIM 0.9704": the figures of whole frames that there are.
std::string to_text(const metrics::SequenceQuality& quality);

/// {"psnr": …, "ssim": …, "disoccluded_4_psnr": …, …}, without what there is not, with "moves" where it does.
nlohmann::ordered_json quality_json(const metrics::FrameQuality& quality);

/// The same of a sequence, with "pooled_psnr", "pixel_std" and "worse_blocks_moving".
nlohmann::ordered_json quality_json(const metrics::SequenceQuality& quality);

struct NamedQuality {
    std::string name;
    metrics::SequenceQuality quality;
};

/// A row a result, a column a figure that any of them has: of whole frames. `emphasise`: the best of each column in
/// bold, by a terminal's escape sequences.
std::string quality_table(std::span<const NamedQuality> results, bool emphasise);

/// The same of places, each table below its title: PSNR and blocks, and SSIM where there are masks.
std::string places_tables(std::span<const NamedQuality> results, bool emphasise);

/// RFC 4180, every figure a column, with all digits; empty where there is none.
std::string quality_csv(std::span<const NamedQuality> results);

}  // namespace clarus::cli
