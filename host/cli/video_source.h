#pragma once

#include <cstddef>
#include <filesystem>
#include <future>
#include <memory>
#include <optional>

#include "cli/frame_source.h"
#include "cli/sequence_options.h"
#include "io/sequence.h"
#include "io/video_reader.h"

namespace clarus::cli {

/// A video as a sequence of colours that `scale` enlarges. Its one frame stands for all, of which nobody knows how many
/// there are; `folder` is the video.
io::Sequence sequence_of(const std::filesystem::path& video, const io::VideoFacts& facts, double scale);

/// A video's frames as they are decoded, the next one meanwhile, until Interrupt comes. Their names are their numbers,
/// "0000".
class VideoSource : public FrameSource {
  public:
    /// `sequence`, that of sequence_of, outlives the source. Errors: VideoReader's at the frames before the first.
    VideoSource(std::unique_ptr<io::VideoReader> video, const io::Sequence& sequence, const FrameRange& frames);
    /// Errors: VideoReader's; invalid_argument where frames that are asked for are not there.
    std::optional<SourceFrame> next() override;
    bool waits() const override { return false; }

    /// About; at least those that are decoded.
    size_t frames() const;
    /// Whether all that was asked for was handed out.
    bool is_over() const { return is_over_; }

  private:
    void read_ahead();

    std::unique_ptr<io::VideoReader> video_;
    const io::Sequence& sequence_;
    const FrameRange frames_;
    size_t number_ = 0;    // of the next frame
    double seconds_ = -1;  // of the frame before it; negative where there was none
    bool is_over_ = false;
    std::future<std::optional<io::VideoPicture>> next_;  // last: it uses what is above
};

}  // namespace clarus::cli
