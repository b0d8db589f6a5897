#pragma once

#include <filesystem>

namespace clarus::bench {

/// Writes an ENSS model (formats.md) of f features and m middle layers with small random weights and one set of
/// kernels.
void write_random_enss(const std::filesystem::path& path, int scale, int features, int middle);

}  // namespace clarus::bench
