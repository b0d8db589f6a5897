#pragma once

#include <filesystem>
#include <map>
#include <set>
#include <string>

#include "clarus/upscaler.h"
#include "cli/frame_loop.h"
#include "io/sequence.h"

namespace clarus::cli {

/// The folder that a file lies in.
std::filesystem::path folder_of(const std::filesystem::path& file);

/// Files that a command reads or also writes, which another of its outputs must not replace.
class TakenFiles {
  public:
    /// `what` it is, for the message: "the model".
    void add(const std::filesystem::path& file, const std::string& what);
    /// Its images, and the folders where a sequence's own files lie, of which --frames may have left some out.
    /// `sequence_path` as it was given.
    void add(const std::filesystem::path& sequence_path, const io::Sequence& sequence);
    /// Takes the file that an option names. Errors: invalid_argument, naming the option, where it would replace one of
    /// these or lie in one of those folders.
    void take(const std::string& option, const std::filesystem::path& file);

  private:
    std::map<std::filesystem::path, std::string> files_;  // past links, as are the folders
    std::set<std::filesystem::path> folders_;
};

/// Refuses what would replace something that the run reads or also writes, or lie among the sequence's own files, of
/// which --frames may have left some out. `sequence_path` as it was given; `report` and `trace` empty where they are
/// not written. Errors: invalid_argument, naming the option.
void refuse_overwriting_inputs(const std::filesystem::path& sequence_path, const io::Sequence& sequence,
                               const Model& model, const FrameOutput& output, const std::filesystem::path& report,
                               const std::filesystem::path& trace);

}  // namespace clarus::cli
