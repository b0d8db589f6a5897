#include "io/file.h"

#include <cerrno>
#include <cstdio>
#include <system_error>

#include "base/error.h"

namespace clarus::io {

void require_file(const std::filesystem::path& path) {
    std::error_code error;
    if (!std::filesystem::is_regular_file(path, error))
        fail(ErrorKind::file, "cannot read {}: {}", path.string(), error ? error.message() : "not a file");
}

std::string read_file(const std::filesystem::path& path, uintmax_t largest) {
    require_file(path);
    std::error_code error;
    const uintmax_t size = std::filesystem::file_size(path, error);
    if (error) fail(ErrorKind::file, "cannot read {}: {}", path.string(), error.message());
    if (size > largest)
        fail(ErrorKind::file, "cannot read {}: {} bytes are more than the {} allowed", path.string(), size, largest);

    std::FILE* file = std::fopen(path.c_str(), "rb");
    if (!file) fail(ErrorKind::file, "cannot read {}: {}", path.string(), std::generic_category().message(errno));
    std::string bytes(size, '\0');
    const size_t count = std::fread(bytes.data(), 1, bytes.size(), file);
    std::fclose(file);
    if (count != size)
        fail(ErrorKind::file, "cannot read {}: it ends after {} of {} bytes", path.string(), count, size);
    return bytes;
}

std::filesystem::path partial_name(const std::filesystem::path& path) {
    return path.parent_path() / fmt::format(".{}.partial", path.filename().string());
}

void write_file_atomically(const std::filesystem::path& path, std::span<const std::byte> bytes) {
    const std::filesystem::path temporary = partial_name(path);
    const auto give_up = [&](int cause) {
        std::error_code ignored;
        std::filesystem::remove(temporary, ignored);
        fail(ErrorKind::file, "cannot write {}: {}", path.string(), std::generic_category().message(cause));
    };

    std::FILE* file = std::fopen(temporary.c_str(), "wb");
    if (!file) give_up(errno);
    const bool all = bytes.empty() || std::fwrite(bytes.data(), 1, bytes.size(), file) == bytes.size();
    const bool written = all && std::fflush(file) == 0;
    const int write_error = errno;
    const bool closed = std::fclose(file) == 0;
    if (!written) give_up(write_error);
    if (!closed) give_up(errno);

    std::error_code error;
    std::filesystem::rename(temporary, path, error);
    if (error) give_up(error.value());
}

}  // namespace clarus::io
