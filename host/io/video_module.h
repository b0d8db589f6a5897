#pragma once

#include <filesystem>
#include <memory>

#include "io/video.h"
#include "io/video_reader.h"

namespace clarus::io {

/// All that Clarus asks of FFmpeg, in a module that a build may be without.
class VideoModule {
  public:
    // write_video and stream_video of io/video.h, open_video of io/video_reader.h. A file is written into `unfinished`,
    // which is there; its name and format are `path`'s.
    virtual std::unique_ptr<VideoWriter> write(const std::filesystem::path& path,
                                               const std::filesystem::path& unfinished,
                                               const VideoSettings& settings) const = 0;
    virtual std::unique_ptr<VideoWriter> stream(const VideoSettings& settings, TakeFragment take) const = 0;
    virtual std::unique_ptr<VideoReader> open(const std::filesystem::path& path) const = 0;

  protected:
    ~VideoModule() = default;
};

/// Loads the module at the first call. Errors: those of module_function; invalid_argument where this build has no
/// videos.
const VideoModule& video_module();

}  // namespace clarus::io
