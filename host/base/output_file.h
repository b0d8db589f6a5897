#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>

namespace clarus {

/// A file that is being written. Until it is committed it lies in the same folder under a name of its own, which is no
/// other writer's: what already lies there, a link too, is not touched. It goes when this does, or when
/// remove_unfinished_files is called. Every file that Clarus leaves is written by one of these.
class OutputFile {
  public:
    /// Errors: file, naming it and the cause (no such folder, permission), or where something other than a regular file
    /// is at its place.
    explicit OutputFile(std::filesystem::path path);
    ~OutputFile();
    OutputFile(const OutputFile&) = delete;
    OutputFile& operator=(const OutputFile&) = delete;

    /// The name that it has until then, for whoever opens it again to write.
    const std::filesystem::path& unfinished() const { return unfinished_; }

    /// Errors: file (disk full).
    void write(std::span<const std::byte> bytes);
    /// Waits until the disk has it, and gives it its name; under that there is the old file or the whole new one, never
    /// a part. Errors: file.
    void commit();

  private:
    [[noreturn]] void give_up(int cause) const;

    std::filesystem::path path_, unfinished_;
    int file_ = -1;
    std::optional<size_t> place_;  // among those that remove_unfinished_files knows
};

/// Removes the files that are being written, and lets no other begin: a thread that tries waits for ever. For signal
/// handlers, just before the process ends; async-signal-safe.
void remove_unfinished_files() noexcept;

}  // namespace clarus
