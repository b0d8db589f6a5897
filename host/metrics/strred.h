#pragma once

#include <optional>
#include <vector>

#include "io/image.h"

namespace clarus::metrics {

/// A plane of doubles.
struct Band {
    Size size;
    std::vector<double> values;  // row by row

    double at(int x, int y) const { return values[static_cast<size_t>(y) * size.width + x]; }
};

/// What STRRED keeps of a frame (Soundararajan and Bovik 2013; docs/metrics.md, "Whole frames"): scaled entropies of
/// the blocks of a band, and of its difference from the frame before.
struct StrredFrame {
    Band band;
    std::vector<double> spatial;   // entropies, weighted; empty where the image has too few blocks
    std::vector<double> temporal;  // likewise; empty without a frame before
};

/// Of display values; `previous` is the frame before, where there is one without a cut between. Errors:
/// invalid_argument for other than three channels, and where the frame before is of another size.
StrredFrame strred_frame(const io::Pixels& image, const StrredFrame* previous);

/// The mean absolute difference of entropies; none where there are none. Errors: invalid_argument unless as many.
std::optional<double> entropic_difference(const std::vector<double>& entropies, const std::vector<double>& reference);

/// The oriented band of an image's luma.
Band oriented_band(const io::Pixels& image);

/// Of the whole blocks of 3×3 of a band, row by row: the entropy given the block's scale, in bits, and that
/// scale's logarithm log₂(1 + s²). None where there are fewer than 9.
struct BlockEntropies {
    std::vector<double> entropies, weights;
};
BlockEntropies block_entropies(const Band& band);

}  // namespace clarus::metrics
