#include "io/file.h"

#include <cerrno>
#include <cstdio>
#include <system_error>

#include "base/error.h"
#include "base/output_file.h"

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

    std::string bytes = read_beginning(path, size);
    if (bytes.size() != size)
        fail(ErrorKind::file, "cannot read {}: it ends after {} of {} bytes", path.string(), bytes.size(), size);
    return bytes;
}

std::string read_beginning(const std::filesystem::path& path, size_t bytes) {
    require_file(path);
    std::FILE* file = std::fopen(path.c_str(), "rb");
    if (!file) fail(ErrorKind::file, "cannot read {}: {}", path.string(), std::generic_category().message(errno));
    std::string result(bytes, '\0');
    result.resize(std::fread(result.data(), 1, result.size(), file));
    std::fclose(file);
    return result;
}

void write_file_atomically(const std::filesystem::path& path, std::span<const std::byte> bytes) {
    OutputFile file(path);
    file.write(bytes);
    file.commit();
}

}  // namespace clarus::io
