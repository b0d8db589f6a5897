#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

namespace clarus::cli {

/// Folders that a command writes into. Those that it had to make and that hold nothing in the end go with it.
class OutputFolders {
  public:
    OutputFolders() = default;
    ~OutputFolders();
    OutputFolders(const OutputFolders&) = delete;
    OutputFolders& operator=(const OutputFolders&) = delete;

    /// Makes the folder where it is missing, and finds out before any work whether a file can be made in it and `bytes`
    /// are free. Leaves no file. Errors: file, naming the folder and the cause.
    void require(const std::filesystem::path& folder, uintmax_t bytes = 0);

  private:
    std::vector<std::filesystem::path> made_;  // parents before children
};

}  // namespace clarus::cli
