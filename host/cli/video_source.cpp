#include "cli/video_source.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "base/error.h"
#include "cli/frame_description.h"
#include "cli/interrupt.h"

namespace clarus::cli {

io::Sequence sequence_of(const std::filesystem::path& video, const io::VideoFacts& facts, double scale) {
    io::Sequence sequence;
    sequence.folder = video;
    sequence.render_size = facts.size;
    sequence.scale = scale;
    sequence.frame_rate = facts.frame_rate;
    sequence.is_described = false;
    sequence.frames.emplace_back();
    sequence.frames.back().name = "0000";
    sequence.frames.back().reset = true;
    return sequence;
}

VideoSource::VideoSource(std::unique_ptr<io::VideoReader> video, const io::Sequence& sequence, const FrameRange& frames)
    : video_(std::move(video)), sequence_(sequence), frames_(frames) {
    read_ahead();
}

void VideoSource::read_ahead() {
    next_ = std::async(std::launch::async, [this] { return video_->next(); });
}

std::optional<SourceFrame> VideoSource::next() {
    std::optional<io::VideoPicture> picture;
    for (bool is_wanted = false; !is_wanted; ++number_) {
        if (Interrupt::came()) return std::nullopt;
        if (frames_.last && number_ >= *frames_.last) {
            is_over_ = true;
            return std::nullopt;
        }
        picture = next_.get();
        if (!picture) {
            frames_.checked_end(number_, sequence_.folder);
            is_over_ = true;
            return std::nullopt;
        }
        read_ahead();
        is_wanted = number_ >= frames_.first;
    }
    const auto pixels = std::make_shared<io::FramePixels>();
    pixels->color = std::move(picture->pixels);
    io::FrameFiles files = sequence_.frames.front();
    files.name = fmt::format("{:04}", number_ - 1);
    files.reset = seconds_ < 0;
    SourceFrame frame;
    frame.name = files.name;
    frame.number = number_ - 1;
    frame.inputs = describe_frame(sequence_, files, *pixels);
    frame.seconds = seconds_ < 0 ? 1 / sequence_.frame_rate : picture->seconds - seconds_;
    frame.hold = pixels;
    seconds_ = picture->seconds;
    return frame;
}

size_t VideoSource::frames() const {
    const size_t end = std::max(frames_.last.value_or(video_->facts().frames.value_or(0)), number_);
    return end - std::min(frames_.first, end);
}

}  // namespace clarus::cli
