#pragma once

#include <CLI/CLI.hpp>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "io/sequence.h"

namespace clarus::cli {

/// `--frames A:B`: frames A ≤ i < B by their index in the sequence; either side may be left out.
struct FrameRange {
    size_t first = 0;
    std::optional<size_t> last;

    /// Errors: CLI::ValidationError.
    static FrameRange parse(const std::string& text);

    bool is_all() const { return first == 0 && !last; }

    /// Leaves those frames. `path` is for the message. Errors: invalid_argument where they are not all there.
    template <typename Frame>
    void cut(std::vector<Frame>& frames, const std::filesystem::path& path) const {
        const size_t end = checked_end(frames.size(), path);
        frames.erase(frames.begin() + static_cast<std::ptrdiff_t>(end), frames.end());
        frames.erase(frames.begin(), frames.begin() + static_cast<std::ptrdiff_t>(first));
    }

    /// The frame after the last, of so many. Errors: cut's.
    size_t checked_end(size_t count, const std::filesystem::path& path) const;
};

/// The options of every command that reads a sequence.
struct SequenceOptions {
    std::filesystem::path path;
    io::Layout layout = io::Layout::guess;
    FrameRange frames;

    void add_to(CLI::App& command);  // but for the path

    /// The sequence with the frames asked for. `scale` tells an NSS capture's ratio, and by what images
    /// alone are upscaled. Errors: those of read_sequence and
    /// FrameRange::cut.
    io::Sequence read(double scale) const;
    /// With all frames.
    io::Sequence read_whole(double scale) const;
};

}  // namespace clarus::cli
