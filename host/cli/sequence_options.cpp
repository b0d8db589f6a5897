#include "cli/sequence_options.h"

#include "base/error.h"
#include "base/parse.h"
#include "cli/choice.h"

namespace clarus::cli {
namespace {

std::optional<size_t> parse_index(std::string_view text, const std::string& range) {
    if (text.empty()) return std::nullopt;
    const std::optional<size_t> index = parse_whole<size_t>(text);
    if (!index) throw CLI::ValidationError("--frames", range + " is not of the form A:B, such as 0:24, 8: or :8");
    return index;
}

}  // namespace

FrameRange FrameRange::parse(const std::string& text) {
    const size_t colon = text.find(':');
    if (colon == std::string::npos)
        throw CLI::ValidationError("--frames", text + " is not of the form A:B, such as 0:24, 8: or :8");
    return {parse_index(std::string_view(text).substr(0, colon), text).value_or(0),
            parse_index(std::string_view(text).substr(colon + 1), text)};
}

size_t FrameRange::checked_end(size_t count, const std::filesystem::path& path) const {
    const size_t end = last.value_or(count);
    if (first >= end || end > count)
        fail(ErrorKind::invalid_argument, "--frames {}:{} is not a range of the {} frames of {}", first, end, count,
             path.string());
    return end;
}

void SequenceOptions::add_to(CLI::App& command) {
    command
        .add_option_function<std::string>(
            "--frames", [this](const std::string& text) { frames = FrameRange::parse(text); },
            "Frames A <= i < B, counted from 0; A: and :B leave the other side open. The first of them starts anew, as "
            "after a cut")
        ->type_name("A:B");
    add_choice<io::Layout, io::Layout>(command, "--layout", layout,
                                       {{"native", io::Layout::native},
                                        {"qrisp", io::Layout::qrisp},
                                        {"nss", io::Layout::nss},
                                        {"images", io::Layout::images}},
                                       "How the sequence is laid out; guessed where not given");
}

io::Sequence SequenceOptions::read(double scale) const {
    io::Sequence sequence = read_whole(scale);
    frames.cut(sequence.frames, path);
    return sequence;
}

io::Sequence SequenceOptions::read_whole(double scale) const { return io::read_sequence(path, layout, scale); }

}  // namespace clarus::cli
