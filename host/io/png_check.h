#pragma once

#include <filesystem>

namespace clarus::io {

/// How much of a PNG is looked at.
enum class PngPart { before_pixels, all };

/// Goes through a file's chunks and their checksums, where it is a PNG. libpng, which reads it afterwards, prints what
/// it finds wrong to standard error before it says so. Errors: file, where it was cut short or damaged, or cannot be
/// read.
void check_png(const std::filesystem::path& path, PngPart part);

}  // namespace clarus::io
