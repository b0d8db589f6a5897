#include "cli/image_folder.h"

#include <algorithm>
#include <array>
#include <system_error>

#include "base/error.h"

namespace clarus::cli {
namespace {

constexpr std::array<const char*, 9> extensions{".png",  ".exr", ".tif", ".tiff", ".jpg",
                                                ".jpeg", ".tga", ".bmp", ".hdr"};

}  // namespace

std::map<std::string, std::filesystem::path> images_in(const std::filesystem::path& folder) {
    std::error_code error;
    std::map<std::string, std::filesystem::path> images;
    for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
        const std::filesystem::path& path = entry.path();
        if (std::find(extensions.begin(), extensions.end(), path.extension().string()) == extensions.end()) continue;
        const auto [other, is_new] = images.emplace(path.stem().string(), path);
        if (!is_new)
            fail(ErrorKind::file, "{} and {} are one frame twice; move one of them away", other->second.string(),
                 path.string());
    }
    if (error) fail(ErrorKind::file, "cannot read the folder {}: {}", folder.string(), error.message());
    if (images.empty()) fail(ErrorKind::file, "there is no image in {}", folder.string());
    return images;
}

std::filesystem::path require_image(const std::map<std::string, std::filesystem::path>& images, const std::string& name,
                                    const std::filesystem::path& folder) {
    const auto found = images.find(name);
    if (found == images.end()) fail(ErrorKind::file, "there is no image of frame {} in {}", name, folder.string());
    return found->second;
}

std::string name_before(const std::string& frame) { return frame + "-before"; }

std::string name_of(const std::filesystem::path& path) {
    const std::filesystem::path normal = std::filesystem::absolute(path).lexically_normal();
    return (normal.has_filename() ? normal : normal.parent_path()).filename().string();
}

}  // namespace clarus::cli
