#pragma once

#include <filesystem>

namespace clarus::io {

/// A folder that files must lie in, after all links are followed.
class Enclosure {
  public:
    /// Errors: std::filesystem::filesystem_error where there is no such folder.
    explicit Enclosure(std::filesystem::path folder);

    const std::filesystem::path& folder() const { return folder_; }
    /// Where the file is that a path leads to, whether there is one or not. Errors: std::filesystem::filesystem_error.
    static std::filesystem::path target_of(const std::filesystem::path& path);
    /// Of a target.
    bool holds(const std::filesystem::path& target) const;
    /// Errors: file, where a link leads the path out of the folder.
    void require(const std::filesystem::path& path) const;

  private:
    std::filesystem::path folder_, canonical_;
};

}  // namespace clarus::io
