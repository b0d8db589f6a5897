#include "io/video_reader.h"

#include <algorithm>
#include <array>
#include <string>
#include <string_view>
#include <system_error>

#include "base/error.h"
#include "io/file.h"
#include "io/image_folder.h"
#include "io/video_module.h"

namespace clarus::io {

bool is_video_input(const std::filesystem::path& path) {
    constexpr std::array<std::string_view, 6> kinds{".mp4", ".m4v", ".mov", ".mkv", ".webm", ".avi"};
    std::error_code none;
    return std::ranges::find(kinds, extension_of(path)) != kinds.end() && !std::filesystem::is_directory(path, none);
}

std::unique_ptr<VideoReader> open_video(const std::filesystem::path& path) {
    require_file(path);
    return video_module().open(path);
}

}  // namespace clarus::io
