#pragma once

#include "clarus/model.h"

namespace clarus::bench {

// Models (docs/formats.md, "A model") with small random weights: time does not depend on them.

/// ENSS of f features and m middle layers, with one set of kernels.
Model random_enss(int scale, int features, int middle);

/// NSRR whose U-Net's outermost layers have `width` channels: 32, or 16 in the lighter network.
Model random_nsrr(int scale, int previous_frames, int width);

/// MNSS and SRPO with the papers' widths.
Model random_mnss(int scale);
Model random_srpo(int scale);

}  // namespace clarus::bench
