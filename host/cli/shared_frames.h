#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "cli/share_publisher.h"
#include "cli/trace.h"
#include "io/frames.h"
#include "io/sequence.h"
#include "link/link.h"

namespace clarus::cli {

/// What a stream is asked to be, beside what the frames are.
struct ShareOptions {
    std::string name;       // or ucx:HOST:PORT/NAME
    double frame_rate = 0;  // 0: as fast as frames are taken
    bool newest = false;    // do not wait for the upscaler
    int slots = 3;
    uint64_t first_number = 0;    // the first frame's
    std::filesystem::path trace;  // a file; empty: none
};

/// Shares frames with `clarus serve`, as a renderer does (clarus/share.h). Waits end where Interrupt comes.
class SharedFrames {
  public:
    /// `sequence`: sizes, scale and conventions. Of the images, all frames have colour. Errors: invalid_argument, file.
    SharedFrames(const io::Sequence& sequence, bool has_depth, bool has_motion, bool is_dynamic, ShareOptions options);
    ~SharedFrames();

    /// Says on a terminal how an upscaler comes to the stream.
    void tell_waiting() const;
    /// The next frame: its images as files of the sequence would hold them. False where Interrupt came instead.
    bool share(const io::FrameFiles& frame, const io::FramePixels& pixels);
    /// Waits until the upscaler is done with all of them. Writes the trace. Errors: file.
    void finish();

    clarus_share_state state() const { return publisher_.state(); }

  private:
    using Clock = std::chrono::steady_clock;

    void wait_for_turn();

    io::Sequence sequence_;  // without frames
    ShareOptions options_;
    std::unique_ptr<link::Link> link_;  // to another machine
    SharePublisher publisher_;
    uint64_t number_;
    Clock::time_point turn_ = Clock::now();
    Trace trace_;
    std::optional<Trace::Span> rendering_;  // of the frame that comes next
};

}  // namespace clarus::cli
