#pragma once

#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "io/sequence.h"

namespace clarus::cli {

/// The folder that a file lies in.
std::filesystem::path folder_of(const std::filesystem::path& file);

/// Where a file or folder is or would be, past links.
std::filesystem::path resolved(const std::filesystem::path& path);

std::vector<std::filesystem::path> images_of(const io::Sequence& sequence);

/// Where files lie, past links.
std::set<std::filesystem::path> folders_of(const std::vector<std::filesystem::path>& files);

/// Files that a command reads or also writes, which another of its outputs must not replace.
class TakenFiles {
  public:
    /// `what` it is, for the message: "the model".
    void add(const std::filesystem::path& file, const std::string& what);
    /// Its images, and the folders where a sequence's own files lie, of which --frames may have left some out.
    /// `sequence_path` as it was given.
    void add(const std::filesystem::path& sequence_path, const io::Sequence& sequence);
    /// A folder, of images that are read by their names: what lies in it is taken, and so is what would lie there.
    void add_folder(const std::filesystem::path& folder);
    /// Takes the file that an option names. Errors: invalid_argument, naming the option, where it would replace one of
    /// these or lie in one of those folders; file, where something is at its place that is no regular file.
    void take(const std::string& option, const std::filesystem::path& file);

  private:
    std::map<std::filesystem::path, std::string> files_;  // past links, as are the folders
    std::set<std::filesystem::path> folders_;
};

}  // namespace clarus::cli
