#pragma once

#include <filesystem>

#include "io/output_layout.h"
#include "io/sequence.h"

namespace clarus::io {

/// docs/formats.md, "A sequence". `description`: the JSON. Errors: file, naming the field.
Sequence read_native(const std::filesystem::path& description);

/// `color`, `depth`, `motion`, `reference` and `sequence.json` in a folder.
std::unique_ptr<OutputLayout> native_output(const std::filesystem::path& folder);

}  // namespace clarus::io
