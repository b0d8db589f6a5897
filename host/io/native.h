#pragma once

#include <filesystem>

#include "io/sequence.h"

namespace clarus::io {

/// formats.md, "A sequence (native layout)". `description`: the JSON. Errors: file, naming the field.
Sequence read_native(const std::filesystem::path& description);

}  // namespace clarus::io
