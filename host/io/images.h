#pragma once

#include <filesystem>

#include "io/sequence.h"

namespace clarus::io {

/// Whether it is an image by its name, or a folder that has one.
bool looks_like_images(const std::filesystem::path& path);

/// A sequence of colours alone, of one size, without jitter (docs/formats.md, "Images"). A folder's come in the order
/// of their names, in which numbers count as such: 9.png before 10.png. Errors: file.
Sequence read_images(const std::filesystem::path& path, double scale);

}  // namespace clarus::io
