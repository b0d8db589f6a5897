#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include "base/error.h"
#include "base/log.h"
#include "clarus/share.h"
#include "cli/commands.h"
#include "cli/interrupt.h"
#include "cli/progress.h"
#include "cli/sequence_options.h"
#include "cli/share_error.h"
#include "io/frames.h"

namespace clarus::cli {
namespace {

using Clock = std::chrono::steady_clock;
using Stream = std::unique_ptr<clarus_share_stream, void (*)(clarus_share_stream*)>;

constexpr int kLookMilliseconds = 100;  // how long an interrupt may take to be seen

struct PlayOptions {
    SequenceOptions sequence;
    std::string name;
    double frame_rate = 0;  // 0: as fast as they are taken
    bool loop = false;
    bool newest = false;
    int slots = 3;
};

bool all_have(const io::Sequence& sequence, std::filesystem::path io::FrameFiles::*image) {
    return std::ranges::none_of(sequence.frames, [&](const io::FrameFiles& frame) { return (frame.*image).empty(); });
}

clarus_share_description describe(const io::Sequence& sequence, const PlayOptions& options) {
    clarus_share_description description = clarus_share_default_description();
    const auto resource = [&](int channels) {
        return clarus_share_resource{
            {CLARUS_F32, channels}, sequence.render_size.width, sequence.render_size.height, 0};
    };
    description.resources[CLARUS_SHARE_COLOR] = resource(3);
    if (all_have(sequence, &io::FrameFiles::depth)) description.resources[CLARUS_SHARE_DEPTH] = resource(1);
    if (all_have(sequence, &io::FrameFiles::motion)) description.resources[CLARUS_SHARE_MOTION] = resource(2);
    description.slots = options.slots;
    description.policy = options.newest ? CLARUS_SHARE_NEWEST_FRAME : CLARUS_SHARE_EVERY_FRAME;
    description.linear_color = sequence.color_space == ColorSpace::linear;
    description.depth_projective = sequence.depth.projective;
    description.depth_reversed = sequence.depth.reversed;
    const MotionEncoding motion = sequence.motion_encoding();
    description.motion_scale_x = motion.scale.x;
    description.motion_scale_y = motion.scale.y;
    description.motion_jittered = motion.jittered;
    description.motion_sampled_at_jitter = motion.sampled_at_jitter;
    description.scale = static_cast<float>(sequence.scale);
    if (sequence.shown_size) {
        description.output_width = sequence.shown_size->width;
        description.output_height = sequence.shown_size->height;
    }
    description.dynamic_resolution = sequence.is_dynamic();
    return description;
}

void fill_in(clarus_share_frame& frame, const io::Sequence& sequence, const io::FrameFiles& files) {
    const Size size = sequence.render_size_of(files);
    frame.width = size.width;
    frame.height = size.height;
    frame.jitter_x = files.jitter.x;
    frame.jitter_y = files.jitter.y;
    frame.exposure = files.exposure;
    frame.near_plane = files.near_plane;
    frame.far_plane = files.far_plane;
    frame.reset = files.reset;
    frame.frame_seconds = static_cast<float>(1 / sequence.frame_rate);
    const Vec2 motion_scale = sequence.motion_scale(files);
    frame.motion_scale_x = motion_scale.x;
    frame.motion_scale_y = motion_scale.y;
    if (!files.camera) return;
    frame.has_matrices = 1;
    frame.fov_y = files.camera->fov_y;
    std::ranges::copy(files.camera->view, frame.view);
    std::ranges::copy(files.camera->projection, frame.projection);
}

void copy(const clarus_share_frame& frame, clarus_share_kind kind, const io::Pixels& pixels) {
    if (frame.images[kind].pixels) check_share(clarus_share_copy(&frame, kind, pixels.values.data(), 0));
}

class Player {
  public:
    Player(const PlayOptions& options, const io::Sequence& sequence, Stream stream)
        : options_(options), sequence_(sequence), stream_(std::move(stream)) {}

    void play() {
        Progress progress("playing");
        do {
            io::FrameReader reader(sequence_, 0, sequence_.frames.size(), true, false, 4);
            while (const std::optional<io::FrameReader::Frame> frame = reader.next()) {
                if (!share(*frame)) return;
                if (!options_.loop) progress.update(frame->index + 1, sequence_.frames.size());
            }
        } while (options_.loop);
        while (!Interrupt::came()) {
            const clarus_share_status status = clarus_share_drain(stream_.get(), kLookMilliseconds);
            tell_message();
            if (status == CLARUS_SHARE_OK) return;
            if (status != CLARUS_SHARE_TIMED_OUT) fail_with_share(status);
        }
    }

    void print_summary() const {
        const clarus_share_state state = clarus_share_stream_state(stream_.get());
        fmt::print("{} frames shared, {} upscaled or skipped\n", state.ready, state.released);
    }

  private:
    /// False where Interrupt came.
    bool share(const io::FrameReader::Frame& read) {
        const io::FrameFiles& files = sequence_.frames[read.index];
        clarus_share_frame frame;
        for (;;) {
            if (Interrupt::came()) return false;
            const clarus_share_status status = clarus_share_begin(stream_.get(), kLookMilliseconds, &frame);
            tell_message();
            if (status == CLARUS_SHARE_OK) break;
            if (status != CLARUS_SHARE_TIMED_OUT) fail_with_share(status);
        }
        wait_for_turn();
        fill_in(frame, sequence_, files);
        frame.number = options_.sequence.frames.first + shared_;
        frame.reset = files.reset || read.index == 0;
        copy(frame, CLARUS_SHARE_COLOR, read.pixels.color);
        copy(frame, CLARUS_SHARE_DEPTH, read.pixels.depth);
        copy(frame, CLARUS_SHARE_MOTION, read.pixels.motion);
        check_share(clarus_share_end(stream_.get(), &frame));
        ++shared_;
        return true;
    }

    /// Frames that are late do not make those that follow come sooner.
    void wait_for_turn() {
        if (options_.frame_rate == 0) return;
        std::this_thread::sleep_until(turn_);
        const auto frame =
            std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(1) / options_.frame_rate);
        turn_ = std::max(turn_, Clock::now() - frame) + frame;
    }

    /// An upscaler that cannot take the frames says so.
    void tell_message() {
        const std::string message = clarus_share_stream_state(stream_.get()).message;
        if (!message.empty() && message != told_) log(LogLevel::warning, "the upscaler left: {}", message);
        told_ = message;
    }

    const PlayOptions& options_;
    const io::Sequence& sequence_;
    Stream stream_;
    uint64_t shared_ = 0;
    Clock::time_point turn_ = Clock::now();
    std::string told_;
};

void play(const PlayOptions& options) {
    const io::Sequence sequence = options.sequence.read(2);
    io::check_sequence(sequence, false, false);
    const clarus_share_description description = describe(sequence, options);
    const Interrupt interrupt;
    clarus_share_stream* stream = nullptr;
    check_share(clarus_share_open(options.name.c_str(), &description, &stream));
    Player player(options, sequence, Stream(stream, clarus_share_close));
    player.play();
    player.print_summary();
}

}  // namespace

void add_play_command(CLI::App& app) {
    CLI::App& command =
        *app.add_subcommand("play", "Share a sequence's frames with `clarus serve`, as a renderer does");
    const auto options = std::make_shared<PlayOptions>();
    command.add_option("SEQUENCE", options->sequence.path, "The sequence's folder or JSON")->required();
    command.add_option("--share", options->name, "The stream's name, by which `clarus serve` finds it")
        ->required()
        ->type_name("NAME");
    options->sequence.add_to(command);
    command
        .add_option("--frame-rate", options->frame_rate,
                    "Frames a second, where they are taken as fast; without, as fast as they are")
        ->type_name("N")
        ->check(CLI::PositiveNumber);
    command.add_flag("--loop", options->loop, "Again and again, until Ctrl-C");
    command.add_flag("--newest", options->newest,
                     "Do not wait for the upscaler: it gets the newest frame. Without, it gets every one");
    command.add_option("--slots", options->slots, "How many frames the stream has room for, 2 to 8")
        ->type_name("N")
        ->capture_default_str();
    command.footer(
        "Frames that were read are held until an upscaler comes. Ctrl-C ends it.\n"
        "Examples:\n"
        "  clarus play sequence --share game\n"
        "  clarus play sequence --share game --frame-rate 30 --loop --newest");
    command.callback([options] { play(*options); });
}

}  // namespace clarus::cli
