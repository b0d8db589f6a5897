#pragma once

#include <future>
#include <string>

#include "io/sequence.h"

namespace clarus::cli {

/// Holds the first frames against what the JSON declares (docs/checking.md), on a thread of its own that takes what
/// time others leave, and logs one warning of what is surely wrong, field by field. Of as many frames and pixels as the
/// tests' truth table; nothing where frames have no motion or are fewer than four. `sequence` outlives the result,
/// whose end waits. What cannot be read is left to whoever upscales it.
std::future<void> watch_conventions(const io::Sequence& sequence, std::string name);

}  // namespace clarus::cli
