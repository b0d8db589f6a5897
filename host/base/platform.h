#pragma once

#include <filesystem>
#include <string>

// What the libraries need of the system that the standard library has not, and is written for POSIX here. Beside it, in
// files of their own: base/module (shared objects), base/output_file, base/place, base/private_files and
// base/python_process.

namespace clarus {

/// The user's: HOME, or else what the system knows; empty where there is none.
std::filesystem::path home_folder();

/// A new folder of the user's alone, called so and a few letters more. Errors: file.
std::filesystem::path make_unique_folder(const std::filesystem::path& beginning);

/// Whether a pattern, of which * stands for any characters and ? for one, is that of all of a text.
bool fits_pattern(const std::string& pattern, const std::string& text);

/// From here on, the calling thread and those that it makes take what time others leave.
void take_idle_time();

/// From here on, this process is asked to end (SIGTERM) where the thread that started it ends; at once if `parent` has.
void end_with_parent(int parent);

/// Keeps other processes and threads out as long as it lives. They have it for as long as it takes to write a file, so
/// that it waits for seconds at most.
class FileLock {
  public:
    explicit FileLock(const std::string& path);
    ~FileLock();
    FileLock(const FileLock&) = delete;
    FileLock& operator=(const FileLock&) = delete;

    bool is_held() const { return is_held_; }

  private:
    int file_;
    bool is_held_ = false;
};

}  // namespace clarus
