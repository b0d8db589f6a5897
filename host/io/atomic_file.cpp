#include "io/atomic_file.h"

#include <cerrno>
#include <cstdio>
#include <system_error>

#include "base/error.h"

namespace clarus::io {

void write_file_atomically(const std::filesystem::path& path, std::span<const std::byte> bytes) {
    const std::filesystem::path temporary = path.parent_path() / ("." + path.filename().string() + ".partial");
    const auto give_up = [&](int cause) {
        std::error_code ignored;
        std::filesystem::remove(temporary, ignored);
        fail(ErrorKind::file, "cannot write {}: {}", path.string(), std::generic_category().message(cause));
    };

    std::FILE* file = std::fopen(temporary.c_str(), "wb");
    if (!file) give_up(errno);
    const bool written = std::fwrite(bytes.data(), 1, bytes.size(), file) == bytes.size() && std::fflush(file) == 0;
    const int write_error = errno;
    const bool closed = std::fclose(file) == 0;
    if (!written) give_up(write_error);
    if (!closed) give_up(errno);

    std::error_code error;
    std::filesystem::rename(temporary, path, error);
    if (error) give_up(error.value());
}

}  // namespace clarus::io
