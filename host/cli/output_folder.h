#pragma once

#include <cstdint>
#include <filesystem>

namespace clarus::cli {

/// Makes the folder where it is missing, and finds out before any work whether a file can be made in it and `bytes` are
/// free. Leaves no file. Errors: file, naming the folder and the cause.
void require_writable_folder(const std::filesystem::path& folder, uintmax_t bytes = 0);

}  // namespace clarus::cli
