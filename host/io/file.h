#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

namespace clarus::io {

/// Errors: file, where there is no regular file, nor a link to one; naming it and the cause.
void require_file(const std::filesystem::path& path);

/// A whole regular file. Errors: file, naming it and the cause; a file of more than `largest` bytes is refused.
std::string read_file(const std::filesystem::path& path, uintmax_t largest = UINTMAX_MAX);

/// The first bytes of a regular file, all where it has fewer. Errors: file, naming it and the cause.
std::string read_beginning(const std::filesystem::path& path, size_t bytes);

/// Writes a file by an OutputFile (base/output_file.h): under `path` there is the old file or the whole new one, never
/// a part. Errors: file, naming it and the cause (no such folder, permission, disk full); nothing is left behind.
void write_file_atomically(const std::filesystem::path& path, std::span<const std::byte> bytes);

}  // namespace clarus::io
