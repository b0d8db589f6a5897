#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "io/output_layout.h"
#include "io/sequence.h"
#include "render/renderer.h"

namespace clarus::render {

/// Writes rendered frames as a sequence. Its description comes last, so that a sequence that has one is whole. Until
/// then `<description>.unfinished.json` beside it says what is being rendered and which frames are done, by a hash of
/// their images: a writer that is given the same again goes on from there.
class SequenceWriter {
  public:
    /// `sequence`: sizes, scale and conventions. `recipe`: an object that says all that the images depend on. Makes the
    /// folders. Errors: file where they cannot be written to, or, unless `replace`, hold a sequence or the beginning of
    /// one that has another recipe; where images lie in them that are no sequence's, which `add` says, too.
    SequenceWriter(std::unique_ptr<io::OutputLayout> layout, io::Sequence sequence, const RenderSettings& settings,
                   nlohmann::ordered_json recipe, bool replace);

    /// The next frame: what describes it (jitter, reset, planes, camera), and a function that renders it, called where
    /// its images are not there already, or damaged. Frames are numbered from 0 as they come.
    void add(const io::FrameFiles& description, const std::function<RenderedFrame()>& render);
    /// After at least one frame.
    void finish();

  private:
    io::FrameFiles files(size_t index) const;
    void write(const io::FrameFiles& frame, const RenderedFrame& images) const;
    void begin(bool replace);
    void note_progress() const;
    /// Errors: file, where an image is there that is not this sequence's.
    void refuse_foreign(const std::filesystem::path& image) const;
    /// Of an earlier run, checked. Errors: file.
    nlohmann::json read_record() const;

    std::unique_ptr<io::OutputLayout> layout_;
    io::Sequence sequence_;
    bool has_reference_, has_output_buffers_;
    nlohmann::ordered_json recipe_;
    std::filesystem::path unfinished_;
    std::vector<std::string> done_;  // a hash of the images of each frame that is done
    bool replaces_ = false;          // or goes on with: a sequence was there
};

}  // namespace clarus::render
