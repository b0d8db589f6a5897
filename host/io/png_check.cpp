#include "io/png_check.h"

#include <zlib.h>

#include <cstdint>
#include <fstream>
#include <string>
#include <string_view>

#include "base/error.h"

namespace clarus::io {
namespace {

constexpr std::string_view signature("\x89PNG\r\n\x1a\n", 8);
constexpr size_t word_size = 4;

/// Big-endian.
uint32_t word(std::string_view bytes) {
    uint32_t value = 0;
    for (size_t i = 0; i < word_size; ++i) value = value << 8 | static_cast<unsigned char>(bytes[i]);
    return value;
}

class File {
  public:
    explicit File(const std::filesystem::path& path)
        : path_(path), stream_(path, std::ios::binary), left_(std::filesystem::file_size(path)) {}

    /// The next bytes, which stay until more are taken.
    std::string_view take(size_t count) {
        if (count > left_) fail(ErrorKind::file, "cannot read image {}: the file was cut short", path_.string());
        left_ -= count;
        bytes_.resize(count);
        if (!stream_.read(bytes_.data(), static_cast<std::streamsize>(count)))
            fail(ErrorKind::file, "cannot read image {}: it cannot be read", path_.string());
        return bytes_;
    }
    uintmax_t left() const { return left_; }

  private:
    const std::filesystem::path& path_;
    std::ifstream stream_;
    uintmax_t left_;
    std::string bytes_;
};

}  // namespace

// PNG (ISO/IEC 15948), clause 5.3: length, type, data, checksum of type and data.
void check_png(const std::filesystem::path& path, PngPart part) {
    File file(path);
    if (file.left() < signature.size() || file.take(signature.size()) != signature) return;
    for (std::string type; type != "IEND";) {
        const uint32_t length = word(file.take(word_size));
        type = file.take(word_size);
        if (part == PngPart::before_pixels && type == "IDAT") return;
        const auto checksum_of = [](uLong of_all_before, std::string_view bytes) {
            return crc32_z(of_all_before, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size());
        };
        const uLong expected = checksum_of(checksum_of(0, type), file.take(length));
        const bool is_critical = type.front() >= 'A' && type.front() <= 'Z';  // others hold no pixels
        if (const uint32_t checksum = word(file.take(word_size)); is_critical && checksum != expected)
            fail(ErrorKind::file, "cannot read image {}: the file is damaged: its chunk {} does not have its checksum",
                 path.string(), type);
    }
}

}  // namespace clarus::io
