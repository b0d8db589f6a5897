#include "cli/resume.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <system_error>
#include <utility>

#include "base/error.h"
#include "base/log.h"
#include "base/precision.h"
#include "cli/pipeline_options.h"

namespace clarus::cli {
namespace {

const char* text_of(Antialiasing antialiasing) { return antialiasing == Antialiasing::mlaa ? "mlaa" : "none"; }

std::string text_of(Size size) { return fmt::format("{}x{}", size.width, size.height); }

// Of one that asks for none, all from the state on.
void check_follows(const FrameRange& asked, const RunState& state, const std::filesystem::path& state_file) {
    if (asked.is_all() || (state.first <= asked.first && asked.first <= state.next)) return;
    fail(ErrorKind::invalid_argument,
         "--frames {}: does not follow on {}, which goes on at frame {} with a run from frame {} on; name a frame from "
         "{} to {}, or leave --resume out to start over",
         asked.first, state_file.string(), state.next, state.first, state.first, state.next);
}

void warn_of_missing(const RunState& state, const io::Sequence& sequence, const IsMade& is_made,
                     const std::filesystem::path& state_file) {
    size_t missing = 0, first = 0;
    for (size_t i = state.first; i < std::min(state.next, sequence.frames.size()); ++i)
        if (!is_made(sequence.frames[i].name) && missing++ == 0) first = i;
    if (missing > 0)
        log(LogLevel::warning,
            "{} of the pictures before that {} counts as done are not there, or damaged; the first is {}", missing,
            state_file.string(), sequence.frames[first].name);
}

}  // namespace

std::map<std::string, std::string> run_settings(const UpscalerOptions& options, const Upscaler& upscaler,
                                                const Model& model) {
    std::map<std::string, std::string> settings{
        {"--model", model.name()},
        {"--scale", fmt::format("{}", model.scale())},
        {"the render size", text_of(upscaler.render_size())},
        {"the output size", text_of(upscaler.output_size())},
        {"--precision", name_of(options.precision)},
        {"--antialias", text_of(options.antialias)},
        {"--antialias-input", text_of(options.antialias_input)},
        {"--sharpen", fmt::format("{}", options.sharpen)},
        {"--view", options.views.empty() ? "none" : fmt::format("{}", fmt::join(options.views, ", "))}};
    for (const PipelineOption& option : model.options()) {
        const auto chosen = options.pipeline_options.find(option.name);
        settings[flag_of(option.name)] =
            fmt::format("{}", chosen == options.pipeline_options.end() ? option.usual : chosen->second);
    }
    return settings;
}

RunFrames resumed_frames(const FrameRange& asked, const io::Sequence& sequence, const std::filesystem::path& path,
                         const std::filesystem::path& state_file, const IsMade& is_made) {
    RunFrames frames{asked.first, asked.first, asked.checked_end(sequence.frames.size(), path)};
    if (std::optional<RunState> state = read_run_state(state_file)) {
        check_follows(asked, *state, state_file);
        warn_of_missing(*state, sequence, is_made, state_file);
        frames.first = state->first;
        frames.begin = state->next;
        frames.state = std::move(state);
        return frames;
    }
    const auto made = [&](size_t i) { return is_made(sequence.frames[i].name); };
    size_t next = frames.begin;
    while (next < frames.end && made(next)) ++next;
    if (next == frames.begin) return frames;
    fmt::print("starting over at frame {}: {} frames are there, but no {}, which says what they were made with\n",
               frames.begin, next - frames.begin, state_file.string());
    return frames;
}

void restore_run(const std::filesystem::path& state_file, const RunState& state, Upscaler& upscaler,
                 Interpolator* interpolator) {
    try {
        upscaler.restore_history(state.upscaler);
        if (interpolator) interpolator->restore_history(state.interpolator);
    } catch (const Error& error) {
        if (error.kind() != ErrorKind::invalid_argument) throw;
        fail(error.kind(), "cannot go on from {}: {}; leave --resume out to start over", state_file.string(),
             error.what());
    }
}

}  // namespace clarus::cli
