#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "clarus/stream.h"
#include "io/frames.h"
#include "io/image.h"
#include "io/sequence.h"

namespace clarus::cli {

/// A frame as a source hands it out.
struct SourceFrame {
    std::string name;                   // what its output is named by: "0000"
    uint64_t number = 0;                // where others may have been left out before it: of all
    FrameDescription inputs;            // all but the output
    size_t colors_without_numbers = 0;  // pixels, where they were read
    bool is_depth_beyond_far = false;   // most of it, where it was read
    bool has_alpha = false;             // its colour, of files
    io::Pixels reference;               // 3 channels, output resolution; empty where there is none
    double seconds = 1.0 / 60;          // after the frame before it
    std::chrono::system_clock::time_point taken = std::chrono::system_clock::now();
    /// What the images lie in: they stay as they are as long as it lives. Frames are let go in their order.
    std::shared_ptr<const void> hold;
};

/// Where the frames come from that cli/frame_loop upscales.
class FrameSource {
  public:
    virtual ~FrameSource() = default;
    /// The next frame; none after the last. Waits. Errors: the source's, at that frame.
    virtual std::optional<SourceFrame> next() = 0;
    /// Whether `next` may wait for somebody who is slow, or who waits for a frame to be let go: what is under way is
    /// better finished before.
    virtual bool waits() const = 0;
};

/// Frames of files, in order, until Interrupt comes.
class SequenceSource : public FrameSource {
  public:
    /// `sequence` outlives the source; `ahead` frames are read before they are asked for. `with_alpha`: colour has four
    /// components, the last 1 where files have no alpha.
    SequenceSource(const io::Sequence& sequence, bool want_motion, bool want_reference, bool with_alpha, size_t ahead);
    std::optional<SourceFrame> next() override;
    bool waits() const override { return false; }

  private:
    const io::Sequence& sequence_;
    const bool with_alpha_;
    io::FrameReader reader_;
};

}  // namespace clarus::cli
