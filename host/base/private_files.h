#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>

namespace clarus {

/// Makes a folder that only its owner may enter, with those above it that are missing. False where it cannot be made,
/// or where it is not the user's own: another's, or one that others may write into.
bool make_private_folder(const std::filesystem::path& folder);

/// A regular file of at most `most` bytes that the user, or root, owns and nobody else may write, nor into its folder;
/// a link or a pipe is none. Without an error: where there is no such file, or it cannot be read, there is none.
std::optional<std::string> read_private_file(const std::filesystem::path& path, size_t most);

}  // namespace clarus
