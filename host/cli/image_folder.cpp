#include "cli/image_folder.h"

#include <system_error>

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

std::vector<std::string> names_of(std::span<const std::filesystem::path> paths) {
    std::vector<std::string> names;
    for (const std::filesystem::path& path : paths) names.push_back(name_of(path));
    if (std::set(names.begin(), names.end()).size() < names.size())
        for (size_t i = 0; i < names.size(); ++i) names[i] = paths[i].string();
    return names;
}

std::set<std::filesystem::path> view_folders(const std::filesystem::path& result) {
    std::error_code none;
    std::set<std::filesystem::path> folders;
    for (const auto& entry : std::filesystem::directory_iterator(result / "views", none))
        if (entry.is_directory()) folders.insert(entry.path());
    return folders;
}

}  // namespace clarus::cli
