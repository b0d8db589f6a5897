#pragma once

#include <filesystem>

#include "io/output_layout.h"
#include "io/sequence.h"

namespace clarus::io {

/// docs/formats.md, "A sequence". `description`: the JSON. Errors: file, naming the field.
Sequence read_native(const std::filesystem::path& description);

/// Whether a file is a description of whatever name: JSON with a list of frames, or damaged JSON, which read_native
/// complains of. Errors: file, where it cannot be read.
bool looks_native(const std::filesystem::path& file);

/// `color`, `depth`, `motion`, `reference` and `sequence.json` in a folder.
std::unique_ptr<OutputLayout> native_output(const std::filesystem::path& folder);

}  // namespace clarus::io
