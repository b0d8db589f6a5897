#pragma once

#include "clarus/export.h"
#include "clarus/types.h"

namespace clarus {

/// The Halton pattern of docs/conventions.md, "Jitter": `frame` ≥ 0, `count` ≥ 1 points before it repeats; in render
/// pixels, each component in [−½, ½). Errors: invalid_argument for less.
CLARUS_API Vec2 halton_jitter(int frame, int count);

/// MNSS's sub-pixel pattern (docs/conventions.md, "Jitter") for the scales 2 and 3: the centre of one of the scale²
/// sub-pixels, in render pixels. `frame` ≥ 0. Errors: invalid_argument for less, or another scale.
CLARUS_API Vec2 mnss_jitter(int frame, int scale);

/// The centre of a sub-pixel taken by chance, the same for a frame every time: what MNSS's pattern is compared with
/// (MNSS, table 5). `frame` ≥ 0, `scale` ≥ 1; in render pixels. Errors: invalid_argument for less.
CLARUS_API Vec2 random_jitter(int frame, int scale);

}  // namespace clarus
