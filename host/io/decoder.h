#pragma once

#include <filesystem>
#include <memory>

#include "io/video_reader.h"

namespace clarus::io {

/// open_video of io/video_reader.h, within the module.
std::unique_ptr<VideoReader> decode_video(const std::filesystem::path& path);

}  // namespace clarus::io
