#pragma once

#include "clarus/types.h"

namespace clarus {

/// The Halton pattern of conventions.md, "Jitter": `frame` ≥ 0, `count` ≥ 1 points before it repeats; in render pixels,
/// each component in [−½, ½).
Vec2 halton_jitter(int frame, int count);

}  // namespace clarus
