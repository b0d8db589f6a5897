#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "io/sequence.h"

namespace clarus::cli {

/// What a run into a folder leaves there for `--resume`, as long as it has not made its sequence's last frame
/// (docs/upscaling.md, "Resuming"): a safetensors file.
struct RunState {
    /// What pixels depend on, and what a run that goes on must have in common: by option, "--precision" → "fp32".
    std::map<std::string, std::string> settings;
    /// Frames of the sequence that are done: first ≤ i < next; none yet where these are the same.
    size_t first = 0, next = 0;
    std::string frames;  // digest_of these
    std::vector<std::byte> upscaler,
        interpolator;  // their save_history after the last of these; the latter may be none
};

/// Where the state of a run into this folder is.
std::filesystem::path run_state_file(const std::filesystem::path& output_folder);

/// Of what the sequence says of itself and of frames [first, next), and of the colour of the last of these: another
/// for other frames. Errors: file.
std::string digest_of(const io::Sequence& sequence, size_t first, size_t next);

/// Errors: file.
void write_run_state(const std::filesystem::path& file, const RunState& state);

/// None where there is no file. Errors: file, where it is no state, is cut short or damaged, with the way out.
std::optional<RunState> read_run_state(const std::filesystem::path& file);

/// Errors: invalid_argument, with all that differs, where the state is of a run of other settings or of another
/// sequence.
void check_run_state(const std::filesystem::path& file, const RunState& state,
                     const std::map<std::string, std::string>& settings, const io::Sequence& sequence);

}  // namespace clarus::cli
