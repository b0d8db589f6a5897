#pragma once

#include <span>
#include <vector>

#include "clarus/types.h"
#include "io/image.h"

namespace clarus::metrics {

/// What an image's blocks of 48×48 pixels are wrong by. Blocks begin at the top left; the last of a row or column are
/// cut by the image's edge.
struct BlockErrors {
    static constexpr int side = 48;

    Size grid;                                // in blocks
    std::vector<double> mean_squared_errors;  // row by row
};

/// Errors: as mean_squared_error.
BlockErrors block_errors(const io::Pixels& image, const io::Pixels& reference);

/// The mean over the hundredth of the blocks, rounded up, that are worst. Errors: invalid_argument where there is none.
double worst_hundredth(std::vector<double> mean_squared_errors);

/// The share of blocks that are worse than the baseline's, 0 to 1. Errors: invalid_argument for another grid.
double share_worse(const BlockErrors& blocks, const BlockErrors& baseline);

}  // namespace clarus::metrics
