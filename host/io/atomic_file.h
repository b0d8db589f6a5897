#pragma once

#include <cstddef>
#include <filesystem>
#include <span>

namespace clarus::io {

/// Writes a file under a temporary name in the same folder, then renames it: under `path` there is the old file or the
/// whole new one, never a part. Errors: file, naming it and the cause (no such folder, permission, disk full); nothing
/// is left behind.
void write_file_atomically(const std::filesystem::path& path, std::span<const std::byte> bytes);

}  // namespace clarus::io
