#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>

#include "clarus/interpolator.h"
#include "clarus/upscaler.h"
#include "cli/run_state.h"
#include "cli/sequence_options.h"
#include "io/sequence.h"

namespace clarus::cli {

/// The frames of a sequence that a run makes, begin ≤ i < end; without `--resume`, those that `--frames` asks for.
struct RunFrames {
    size_t first = 0;  // also of the runs that it goes on with
    size_t begin = 0, end = 0;
    std::optional<RunState> state{};  // of the frames before, that it goes on from

    bool is_empty() const { return begin >= end; }
};

/// Of RunState::settings, those of the upscaler.
std::map<std::string, std::string> run_settings(const UpscalerOptions& options, const Upscaler& upscaler,
                                                const Model& model);

/// Whether a frame of this name is complete on the disk.
using IsMade = std::function<bool(const std::string&)>;

/// Those of a run with `--resume`: from where the state in the file says; without one, all, and where some of them are
/// there already it prints that it starts over. `path`: the sequence's, for messages. Errors: read_run_state's;
/// invalid_argument where the frames asked for do not follow on those that are made.
RunFrames resumed_frames(const FrameRange& asked, const io::Sequence& sequence, const std::filesystem::path& path,
                         const std::filesystem::path& state_file, const IsMade& is_made);

/// Goes on from the state; `interpolator` may be null. Errors: those of Upscaler::restore_history, with the way out.
void restore_run(const std::filesystem::path& state_file, const RunState& state, Upscaler& upscaler,
                 Interpolator* interpolator);

}  // namespace clarus::cli
