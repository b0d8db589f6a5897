#pragma once

#include <chrono>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>

#include "io/image.h"

namespace clarus::io {

struct VideoSettings {
    Size size;
    double frame_rate = 60;  // about: every picture has its own time
    std::optional<int> crf;  // quality at any bit rate, the encoder's: from 0, which is best, to 51, of WebM to 63
    int bits = 8;            // of a value, 8 or 10; of streams 8
};

/// Takes pictures, and encodes them in 4:2:0, in the limited range of BT.709, with sRGB's transfer function;
/// streams and files say so. Sides that are odd, which 4:2:0 cannot have, are a pixel longer than the pictures': the
/// last one repeated.
class VideoWriter {
  public:
    using WallTime = std::chrono::system_clock::time_point;

    virtual ~VideoWriter() = default;
    /// `pixels` are display values, of which the first three channels are taken; `seconds` after the first picture, and
    /// after the one before; `made`: when the picture was begun, which streams tell. Errors: invalid_argument for
    /// another size; file, naming the file or stream and the cause.
    virtual void write(const Pixels& pixels, double seconds, WallTime made) = 0;
    /// After the last picture. Errors: file. Without, a file is not there.
    virtual void finish() = 0;
};

/// Whether a file of this name is a video: .mp4 and .mkv (H.264), .webm (VP9).
bool is_video(const std::filesystem::path& path);

/// Errors: invalid_argument where this build has no videos.
void require_videos();

/// The largest `crf` of the video's encoder.
int largest_crf(const std::filesystem::path& path);

/// The file has a temporary name until `finish`. Errors: file; invalid_argument where this build has no videos, FFmpeg
/// has no such encoder, or the encoder cannot do the size.
std::unique_ptr<VideoWriter> write_video(const std::filesystem::path& path, const VideoSettings& settings);

/// A part of a stream: first what a player begins with, then a fragment a picture, at once. `is_key`: a player may
/// begin here, after that first part.
using TakeFragment = std::function<void(std::span<const std::byte> bytes, bool is_key)>;

/// H.264 for low latency in fragmented MP4: no picture waits for the next. A key picture a second. Each fragment tells
/// when its picture was made (`prft`, ISO/IEC 14496-12). Errors: as write_video; `take`'s.
std::unique_ptr<VideoWriter> stream_video(const VideoSettings& settings, TakeFragment take);

}  // namespace clarus::io
