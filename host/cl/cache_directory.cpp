#include <pwd.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>

#include "clarus/device.h"

namespace clarus {

std::string cache_directory() {
    const auto variable = [](const char* name) {
        const char* value = std::getenv(name);
        return std::filesystem::path(value ? value : "");
    };
    if (const auto folder = variable("CLARUS_CACHE_DIR"); !folder.empty()) return folder.string();
    if (const auto folder = variable("XDG_CACHE_HOME"); folder.is_absolute()) return (folder / "clarus").string();
    std::filesystem::path home = variable("HOME");
    if (home.empty())
        if (const passwd* user = getpwuid(getuid()); user && user->pw_dir) home = user->pw_dir;
    return home.is_absolute() ? (home / ".cache" / "clarus").string() : std::string();
}

}  // namespace clarus
