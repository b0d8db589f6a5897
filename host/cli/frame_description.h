#pragma once

#include "clarus/stream.h"
#include "io/frames.h"
#include "io/sequence.h"

namespace clarus::cli {

/// Pixels as an image in host memory; an empty one where there are none.
Image image_of(io::Pixels& pixels);

/// A frame of the sequence with these inputs, without an output. The pixels must outlive it.
FrameDescription describe_frame(const io::Sequence& sequence, const io::FrameFiles& frame, io::FramePixels& pixels);

}  // namespace clarus::cli
