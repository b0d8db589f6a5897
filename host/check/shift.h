#pragma once

#include "check/warping.h"

namespace clarus::check {

/// By how much the frame before, warped by the vectors alone, must be moved to lie on the present one: what the change
/// of the jitter is, measured. Least squares over the image's gradients, in a few steps. In render pixels; NaN where
/// there is too little structure.
Vec2 measure_shift(const Film& film, Pair pair, const Reading& reading);

/// An image of the frame before (any channels) as a reading warps it on to the present one; 0 where it comes from
/// outside.
io::Pixels warped(const Film& film, Pair pair, const Reading& reading, const io::Pixels& before);

}  // namespace clarus::check
