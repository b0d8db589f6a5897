#include "cli/printable.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>

namespace clarus::cli {
namespace {

bool is_continuation(unsigned char byte) { return byte >= 0x80 && byte < 0xc0; }

/// Bytes of the UTF-8 character, or of the harmless sequence, that `text` begins with; 0 where it is neither.
size_t harmless(std::string_view text) {
    for (const std::string_view sequence : {"\033[1m", "\033[0m"})
        if (text.starts_with(sequence)) return sequence.size();
    const auto first = static_cast<unsigned char>(text[0]);
    if (first < 0x80) return first == '\n' || first == '\t' || (first >= 0x20 && first != 0x7f) ? 1 : 0;
    const size_t length = first >= 0xf0 && first < 0xf8 ? 4 : first >= 0xe0 ? 3 : first >= 0xc2 ? 2 : 0;
    if (first >= 0xf8 || length == 0 || text.size() < length) return 0;
    for (size_t i = 1; i < length; ++i)
        if (!is_continuation(static_cast<unsigned char>(text[i]))) return 0;
    const bool is_control = first == 0xc2 && static_cast<unsigned char>(text[1]) < 0xa0;
    return is_control ? 0 : length;
}

ssize_t write_printable(void*, const char* bytes, size_t count) {
    const std::string text = printable({bytes, count});
    for (size_t done = 0; done < text.size();) {
        const ssize_t written = write(STDOUT_FILENO, text.data() + done, text.size() - done);
        if (written < 0 && errno == EINTR) continue;
        if (written < 0) return 0;
        done += static_cast<size_t>(written);
    }
    return static_cast<ssize_t>(count);
}

}  // namespace

std::string printable(std::string_view text) {
    std::string result;
    while (!text.empty()) {
        const size_t length = harmless(text);
        if (length > 0)
            result += text.substr(0, length);
        else
            result += fmt::format("\\x{:02x}", static_cast<unsigned char>(text[0]));
        text.remove_prefix(length > 0 ? length : 1);
    }
    return result;
}

void guard_terminal() {
    if (!isatty(STDOUT_FILENO)) return;
    std::FILE* guarded =
        fopencookie(nullptr, "w", {.read = nullptr, .write = write_printable, .seek = nullptr, .close = nullptr});
    if (!guarded) return;
    constexpr size_t line = size_t{1} << 16;
    std::setvbuf(guarded, nullptr, _IOLBF, line);
    stdout = guarded;
}

}  // namespace clarus::cli
