#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <optional>

#include "cli/commands.h"
#include "cli/interrupt.h"
#include "cli/progress.h"
#include "cli/sequence_options.h"
#include "cli/share_options.h"
#include "cli/shared_frames.h"
#include "cli/taken_files.h"
#include "io/frames.h"

namespace clarus::cli {
namespace {

struct PlayOptions {
    SequenceOptions sequence;
    ShareOptions share;
    bool loop = false;
};

bool all_have(const io::Sequence& sequence, std::filesystem::path io::FrameFiles::*image) {
    return std::ranges::none_of(sequence.frames, [&](const io::FrameFiles& frame) { return (frame.*image).empty(); });
}

/// False where Interrupt came.
bool share_all(const io::Sequence& sequence, SharedFrames& shared, Progress* progress) {
    io::FrameReader reader(sequence, 0, sequence.frames.size(), true, false, 4);
    while (const std::optional<io::FrameReader::Frame> frame = reader.next()) {
        if (!shared.share(sequence.frames[frame->index], frame->pixels)) return false;
        if (progress) progress->update(frame->index + 1, sequence.frames.size());
    }
    return true;
}

void play(const PlayOptions& options) {
    io::Sequence sequence = options.sequence.read(2);
    io::check_sequence(sequence, false, false);
    if (!options.share.trace.empty()) {
        TakenFiles taken;
        taken.add(options.sequence.path, sequence);
        taken.take("--trace", options.share.trace);
    }
    sequence.frames.front().reset = true;  // whatever came before it
    const Interrupt interrupt;
    ShareOptions share = options.share;
    share.first_number = options.sequence.frames.first;
    SharedFrames shared(sequence, all_have(sequence, &io::FrameFiles::depth),
                        all_have(sequence, &io::FrameFiles::motion), sequence.is_dynamic(), share);
    shared.tell_waiting();
    if (options.loop) {
        while (share_all(sequence, shared, nullptr)) continue;
    } else {
        Progress progress("playing");
        share_all(sequence, shared, &progress);
    }
    shared.finish();
    fmt::print("{} frames shared, {} upscaled or skipped\n", shared.state().ready, shared.state().released);
}

}  // namespace

void add_play_command(CLI::App& app) {
    CLI::App& command =
        *app.add_subcommand("play", "Share a sequence's frames with `clarus serve`, as a renderer does");
    const auto options = std::make_shared<PlayOptions>();
    command.add_option("SEQUENCE", options->sequence.path, "The sequence's folder or JSON")->required();
    add_share_options(command, options->share)->required();
    options->sequence.add_to(command);
    command.add_flag("--loop", options->loop, "Again and again, until Ctrl-C");
    command.footer(
        "Frames are held until an upscaler comes. Ctrl-C ends it.\n"
        "Examples:\n"
        "  clarus play sequence --share game\n"
        "  clarus play sequence --share game --frame-rate 30 --loop --newest");
    command.callback([options] { play(*options); });
}

}  // namespace clarus::cli
