#pragma once

#include "io/image.h"

namespace clarus::io {

/// Takes the fourth channel of four away: one channel of its size. Empty where there are fewer.
Pixels take_alpha(Pixels& color);

/// Colour of 3 channels with alpha as a fourth: 1 everywhere where `alpha` is empty.
Pixels with_alpha(const Pixels& color, const Pixels& alpha);

}  // namespace clarus::io
