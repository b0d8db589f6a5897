#include <cstdlib>
#include <filesystem>

#include "base/platform.h"
#include "clarus/device.h"

namespace clarus {

std::string cache_directory() {
    const auto variable = [](const char* name) {
        const char* value = std::getenv(name);
        return std::filesystem::path(value ? value : "");
    };
    if (const auto folder = variable("CLARUS_CACHE_DIR"); !folder.empty()) return folder.string();
    if (const auto folder = variable("XDG_CACHE_HOME"); folder.is_absolute()) return (folder / "clarus").string();
    const std::filesystem::path home = home_folder();
    return home.is_absolute() ? (home / ".cache" / "clarus").string() : std::string();
}

}  // namespace clarus
