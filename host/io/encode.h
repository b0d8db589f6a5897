#pragma once

#include "io/image.h"
#include "io/sequence.h"

namespace clarus::io {

/// Canonical depth (docs/conventions.md, "Depth"; times the far plane the view distance, also where the encoding is
/// projective) as the sequence stores it. `frame` has the planes, which must be finite.
Pixels encode_depth(const Pixels& canonical, const Sequence& sequence, const FrameFiles& frame);

/// Canonical motion of a frame as the sequence stores it; jitters of this frame and the one before in render pixels.
Pixels encode_motion(const Pixels& canonical, const Sequence& sequence, const FrameFiles& frame, Vec2 jitter,
                     Vec2 previous_jitter);

}  // namespace clarus::io
