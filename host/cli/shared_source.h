#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "clarus/share.h"
#include "clarus/stream.h"
#include "cli/frame_source.h"
#include "io/sequence.h"

namespace clarus::cli {

/// A renderer's stream, as it was when it was connected to.
struct SharedStream {
    std::shared_ptr<clarus_share_reader> reader;  // whose memory the frames lie in
    io::Sequence sequence;                        // without frames; scale 0 where the renderer does not say one
    MotionEncoding motion;
    ImageFormat color_format, depth_format, motion_format;
    bool has_depth = false, has_motion = false;
    std::optional<ImageFormat> reactive_format, transparency_format, opaque_format, ui_format;  // where it has them
    bool is_dynamic = false;
    bool is_newest = false;           // the renderer does not wait
    std::vector<std::string> unread;  // names of what it has beside these, which no model reads
};

/// Frames of a renderer in another process (clarus/share.h). A renderer that dies is waited for.
class SharedSource : public FrameSource {
  public:
    /// `goes_on`: a renderer that closes its stream is waited for, too. Errors: invalid_argument, naming the name.
    SharedSource(std::string name, bool goes_on);

    /// Called for each stream that is connected to, before its first frame. What it throws refuses the renderer.
    void on_connection(std::function<void()> prepare) { prepare_ = std::move(prepare); }

    /// Waits for a renderer; false where Interrupt came first. Errors: invalid_argument where the renderer refuses;
    /// file for what else cannot be; those of `prepare`. Where it goes on, they are logged, and another is waited for.
    bool connect();

    /// None where the stream has ended, or Interrupt came.
    std::optional<SourceFrame> next() override;
    bool waits() const override;

    /// The stream of the frame that `next` gave last, or that was connected to.
    std::shared_ptr<const SharedStream> stream() const { return stream_; }

    /// Tells the renderer why its frames are not taken, and leaves.
    void refuse(const std::string& why);

    /// Safe to ask for from another thread.
    struct Figures {
        bool connected = false;
        uint64_t frames = 0, skipped = 0, connections = 0;
        double frames_per_second = 0;  // of the last frames, to 64
        double milliseconds = 0;       // from a frame's being taken to its being let go; likewise
    };
    Figures figures() const;

  private:
    using Clock = std::chrono::steady_clock;
    class Log;

    /// `skipped`: how many frames before it.
    SourceFrame frame_of(const clarus_share_frame& shared, uint64_t skipped) const;

    bool is_met(std::shared_ptr<clarus_share_reader> reader);
    void give_up(const std::string& why);

    std::string name_;
    bool goes_on_;
    std::function<void()> prepare_;
    std::string trouble_;
    std::shared_ptr<const SharedStream> stream_;
    std::shared_ptr<Log> log_;  // shared with frames that are not let go yet
};

}  // namespace clarus::cli
