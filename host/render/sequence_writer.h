#pragma once

#include <filesystem>
#include <vector>

#include "io/sequence.h"
#include "render/renderer.h"

namespace clarus::render {

/// Writes rendered frames as a sequence of the native layout (formats.md). `sequence.json` comes last, so that a folder
/// that has one is whole; a writer that goes without `finish` takes its files with it.
class SequenceWriter {
  public:
    /// Makes the folder. Errors: file where it cannot be written to, or holds a sequence and `replace` is false.
    SequenceWriter(std::filesystem::path folder, const RenderSettings& settings, double scale, bool replace);
    ~SequenceWriter();
    SequenceWriter(const SequenceWriter&) = delete;
    SequenceWriter& operator=(const SequenceWriter&) = delete;

    /// Frames are numbered from 0 as they come.
    void add(const RenderedFrame& frame, Vec2 jitter);
    /// After at least one frame.
    void finish();

  private:
    std::filesystem::path new_file(const char* kind, const std::string& name);
    void remove_files() noexcept;

    io::Sequence sequence_;
    std::vector<std::filesystem::path> made_;  // files and folders, in the order they were made
    bool finished_ = false;
};

}  // namespace clarus::render
