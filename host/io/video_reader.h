#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>

#include "io/image.h"

namespace clarus::io {

/// What a video's file says of its pictures.
struct VideoFacts {
    Size size;
    double frame_rate = 60;        // about: every picture has its own time
    int bits = 8;                  // of a value
    std::optional<size_t> frames;  // about, where the file tells
    bool has_audio = false;
};

struct VideoPicture {
    Pixels pixels;       // 3 channels, display values in [0, 1]: docs/formats.md, "A video"
    double seconds = 0;  // after the first picture; more than the one before
};

/// Decodes a video picture by picture; no more than a few of them are in memory.
class VideoReader {
  public:
    virtual ~VideoReader() = default;
    virtual const VideoFacts& facts() const = 0;
    /// The next picture; none after the last. Errors: file, naming the picture: where it is damaged, the file is cut
    /// short, or the picture is not of the first one's size.
    virtual std::optional<VideoPicture> next() = 0;
};

/// Whether a path is a video's, by its extension (docs/formats.md, "A video"), and no folder's.
bool is_video_input(const std::filesystem::path& path);

/// Reads that file and no other, whatever it names. Errors: file, where it is no video that can be read, is turned when
/// it is shown, or its colours are other than docs/formats.md, "A video", has; invalid_argument where this build has no
/// videos.
std::unique_ptr<VideoReader> open_video(const std::filesystem::path& path);

}  // namespace clarus::io
