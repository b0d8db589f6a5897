#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "base/hash.h"

namespace clarus::ocl {

/// The hash of everything that a cached thing depends on.
using CacheKey = Hash;

/// Blobs in a folder, one file each, that several processes may share: an entry is an OutputFile (base/output_file.h),
/// and carries its key, length and hash, so that a damaged or foreign one reads as absent, as does one that another
/// user owns or may write (base/private_files.h). Nothing here throws for what the disk does: a folder that cannot be
/// written to costs one warning, and nothing is kept; without one (an empty path) nothing is, either.
class DiskCache {
  public:
    explicit DiskCache(std::filesystem::path folder) : folder_(std::move(folder)) {}

    std::optional<std::vector<unsigned char>> load(const CacheKey& key) const;
    void store(const CacheKey& key, const std::vector<unsigned char>& payload) const;

    /// Where the entry of this key is, or would be.
    std::filesystem::path path(const CacheKey& key) const;

  private:
    std::filesystem::path folder_;
};

/// The folder of compiled programs and of what was found out about devices: cache_directory()/programs; empty where
/// there is none.
std::filesystem::path programs_directory();

}  // namespace clarus::ocl
