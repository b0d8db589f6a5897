#include "cli/image_folder.h"

#include "base/error.h"

namespace clarus::cli {

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
