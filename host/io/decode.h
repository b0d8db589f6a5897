#pragma once

#include "io/image.h"
#include "io/sequence.h"

namespace clarus::io {

/// Stored depth (one channel, unpacked) as canonical depth: docs/conventions.md, "Depth". `frame` has the planes. What
/// the device does with a model's input, for what is only measured with.
Pixels decode_depth(const Pixels& stored, const Sequence& sequence, const FrameFiles& frame);

/// Stored motion (two channels, of any size) without a jitter in its values as canonical motion, in the frame's render
/// pixels; both components are NaN where a vector is invalid (docs/conventions.md, "Motion").
Pixels decode_motion(const Pixels& stored, const Sequence& sequence, const FrameFiles& frame);

}  // namespace clarus::io
