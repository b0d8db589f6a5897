#include "base/private_files.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <system_error>

namespace clarus {
namespace {

bool is_own(const struct stat& status) {
    const bool owned = status.st_uid == geteuid() || status.st_uid == 0;
    return owned && (status.st_mode & (S_IWGRP | S_IWOTH)) == 0;
}

/// In a folder of their own, or that everyone may write, others may put another in place of a folder; of sticky ones,
/// such as /tmp, not.
bool may_be_replaced(const std::filesystem::path& folder) {
    std::error_code error;
    const std::filesystem::path whole = std::filesystem::canonical(folder, error);
    if (error) return true;
    for (std::filesystem::path parent = whole; parent != parent.parent_path();) {
        parent = parent.parent_path();
        struct stat status;
        if (stat(parent.c_str(), &status) != 0) return true;
        if (status.st_uid != geteuid() && status.st_uid != 0) return true;
        if ((status.st_mode & S_IWOTH) && !(status.st_mode & S_ISVTX)) return true;
    }
    return false;
}

bool is_own_folder(const std::filesystem::path& folder) {
    struct stat status;
    return stat(folder.c_str(), &status) == 0 && S_ISDIR(status.st_mode) && is_own(status) && !may_be_replaced(folder);
}

}  // namespace

bool make_private_folder(const std::filesystem::path& folder) {
    std::filesystem::path part;
    for (const std::filesystem::path& name : folder) {
        part /= name;
        mkdir(part.c_str(), 0700);  // what comes of it is seen below
    }
    return is_own_folder(folder);
}

std::optional<std::string> read_private_file(const std::filesystem::path& path, size_t most) {
    if (!is_own_folder(path.parent_path())) return std::nullopt;
    const int file = open(path.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
    if (file < 0) return std::nullopt;
    std::optional<std::string> bytes;
    struct stat status;
    if (fstat(file, &status) == 0 && S_ISREG(status.st_mode) && is_own(status) &&
        static_cast<uintmax_t>(status.st_size) <= most) {
        bytes.emplace(static_cast<size_t>(status.st_size), '\0');
        for (size_t done = 0; bytes && done < bytes->size();) {
            const ssize_t count = read(file, bytes->data() + done, bytes->size() - done);
            if (count < 0 && errno == EINTR) continue;
            if (count <= 0)
                bytes.reset();
            else
                done += static_cast<size_t>(count);
        }
    }
    close(file);
    return bytes;
}

}  // namespace clarus
