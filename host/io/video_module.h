#pragma once

#include <filesystem>
#include <memory>

#include "io/video.h"

namespace clarus::io {

/// All that Clarus asks of FFmpeg, in a module that a build may be without.
class VideoModule {
  public:
    // write_video and stream_video of io/video.h. A file is written into `unfinished`, which is there; its name and
    // format are `path`'s.
    virtual std::unique_ptr<VideoWriter> write(const std::filesystem::path& path,
                                               const std::filesystem::path& unfinished,
                                               const VideoSettings& settings) const = 0;
    virtual std::unique_ptr<VideoWriter> stream(const VideoSettings& settings, TakeFragment take) const = 0;

  protected:
    ~VideoModule() = default;
};

}  // namespace clarus::io
