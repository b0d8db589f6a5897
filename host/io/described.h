#pragma once

#include "io/sequence.h"

namespace clarus::io {

/// Refuses images or a video of which no more than colour is known for what needs more. Errors: file, naming what is
/// missing and the way out.
void check_described(const Sequence& sequence, bool needs_depth, bool needs_motion);

}  // namespace clarus::io
