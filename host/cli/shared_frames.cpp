#include "cli/shared_frames.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <thread>
#include <utility>
#include <vector>

#include "base/error.h"
#include "cli/interrupt.h"

namespace clarus::cli {
namespace {

clarus_share_description describe(const io::Sequence& sequence, bool has_depth, bool has_motion, bool is_dynamic,
                                  const ShareOptions& options) {
    clarus_share_description description = clarus_share_default_description();
    const auto image = [&](int channels, Size size) {
        return clarus_share_resource{{CLARUS_F32, channels}, size.width, size.height, 0};
    };
    const auto resource = [&](int channels) { return image(channels, sequence.render_size); };
    description.resources[CLARUS_SHARE_COLOR] = resource(3);
    if (has_depth) description.resources[CLARUS_SHARE_DEPTH] = resource(1);
    if (has_motion) description.resources[CLARUS_SHARE_MOTION] = resource(2);
    if (sequence.any_has("reactive")) description.resources[CLARUS_SHARE_REACTIVE_MASK] = resource(1);
    if (sequence.any_has("transparency")) description.resources[CLARUS_SHARE_TRANSPARENCY_MASK] = resource(1);
    if (sequence.any_has("opaque_color")) description.resources[CLARUS_SHARE_OPAQUE_COLOR] = resource(3);
    if (sequence.any_has("ui")) description.resources[CLARUS_SHARE_UI] = image(4, sequence.output_size());
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
    description.dynamic_resolution = is_dynamic;
    return description;
}

/// Of a stream that a link alone is to find: always the same, so that what a crash leaves of it is replaced.
std::string stream_name(const ShareOptions& options) {
    constexpr size_t kMost = 64;
    const auto remote = link::parse_remote_stream(options.name, "--share");
    if (!remote) return options.name;
    std::string name = fmt::format("to.{}.{}.{}", remote->address.host, remote->address.port, remote->name);
    for (char& letter : name)
        if (!std::isalnum(static_cast<unsigned char>(letter)) && letter != '.') letter = '-';
    return name.substr(0, kMost);
}

/// So that it is not found after the last frame.
void check_trace(const std::filesystem::path& trace) {
    if (trace.empty()) return;
    const std::filesystem::path folder = trace.has_parent_path() ? trace.parent_path() : ".";
    std::error_code unreadable;
    if (!std::filesystem::is_directory(folder, unreadable) || std::filesystem::is_directory(trace, unreadable))
        fail(ErrorKind::file, "--trace {}: not a file in a folder that is there", trace.string());
}

io::Sequence without_frames(io::Sequence sequence) {
    sequence.frames.clear();
    return sequence;
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
    const Vec2 motion_scale = sequence.motion_scale(files);
    frame.motion_scale_x = motion_scale.x;
    frame.motion_scale_y = motion_scale.y;
    if (!files.camera) return;
    frame.has_matrices = 1;
    frame.fov_y = files.camera->fov_y;
    std::ranges::copy(files.camera->view, frame.view);
    std::ranges::copy(files.camera->projection, frame.projection);
}

/// Where the stream has such masks. Of a frame without one, zeros: a stream's frames all bring the same.
/// Zeros where this frame has none.
void copy_optional(const clarus_share_frame& frame, clarus_share_kind kind, const io::Pixels& pixels) {
    const clarus_share_image& image = frame.images[kind];
    if (!image.pixels) return;
    if (!pixels.values.empty()) {
        if (pixels.size != Size{image.width, image.height})
            fail(ErrorKind::file, "frame {}: {} has {}x{} pixels where {}x{} are shared", frame.number,
                 clarus_share_kind_name(kind), pixels.size.width, pixels.size.height, image.width, image.height);
        return SharePublisher::copy(frame, kind, pixels.values.data());
    }
    const std::vector<float> none(static_cast<size_t>(image.width) * image.height * image.format.channels);
    SharePublisher::copy(frame, kind, none.data());
}

}  // namespace

SharedFrames::SharedFrames(const io::Sequence& sequence, bool has_depth, bool has_motion, bool is_dynamic,
                           ShareOptions options)
    : sequence_(without_frames(sequence)),
      options_(std::move(options)),
      publisher_(stream_name(options_), describe(sequence, has_depth, has_motion, is_dynamic, options_)),
      number_(options_.first_number),
      trace_(!options_.trace.empty()) {
    check_trace(options_.trace);
    if (const auto remote = link::parse_remote_stream(options_.name, "--share"))
        link_ = link::send_frames(stream_name(options_), *remote);
    rendering_.emplace(trace_, Trace::Track::main, "render");
}

SharedFrames::~SharedFrames() {
    constexpr int kLastWordMilliseconds = 2000;
    publisher_.close();
    if (link_ && link_->state().connected) link_->finish(kLastWordMilliseconds);
}

void SharedFrames::tell_waiting() const {
    if (isatty(STDERR_FILENO) && !link_)
        fmt::print(stderr, "sharing {}; `clarus serve {} --model …` upscales it; Ctrl-C ends\n", options_.name,
                   options_.name);
}

bool SharedFrames::share(const io::FrameFiles& files, const io::FramePixels& pixels) {
    const std::string name = frame_name(number_);
    rendering_->set_frame(name);
    rendering_.reset();
    clarus_share_frame frame;
    {
        const Trace::Span span(trace_, Trace::Track::main, "wait for a slot", name);
        if (!publisher_.begin(frame)) return false;
        wait_for_turn();
    }
    {
        const Trace::Span span(trace_, Trace::Track::main, "copy into the slot", name);
        fill_in(frame, sequence_, files);
        const double frame_rate = options_.frame_rate != 0 ? options_.frame_rate : sequence_.frame_rate;
        frame.frame_seconds = static_cast<float>(1 / frame_rate);
        frame.number = number_++;
        SharePublisher::copy(frame, CLARUS_SHARE_COLOR, pixels.color.values.data());
        SharePublisher::copy(frame, CLARUS_SHARE_DEPTH, pixels.depth.values.data());
        SharePublisher::copy(frame, CLARUS_SHARE_MOTION, pixels.motion.values.data());
        copy_optional(frame, CLARUS_SHARE_REACTIVE_MASK, pixels.reactive_mask);
        copy_optional(frame, CLARUS_SHARE_TRANSPARENCY_MASK, pixels.transparency_mask);
        copy_optional(frame, CLARUS_SHARE_OPAQUE_COLOR, pixels.opaque_color);
        copy_optional(frame, CLARUS_SHARE_UI, pixels.ui);
        publisher_.end(frame);
    }
    rendering_.emplace(trace_, Trace::Track::main, "render");
    return true;
}

void SharedFrames::finish() {
    if (!options_.trace.empty()) trace_.write(options_.trace);
    publisher_.drain();
}

// Frames that are late do not make those that follow come sooner.
void SharedFrames::wait_for_turn() {
    if (options_.frame_rate == 0) return;
    constexpr std::chrono::milliseconds kLook(Interrupt::look_milliseconds);
    while (Clock::now() < turn_ && !Interrupt::came())
        std::this_thread::sleep_until(std::min<Clock::time_point>(turn_, Clock::now() + kLook));
    const auto frame =
        std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(1) / options_.frame_rate);
    turn_ = std::max(turn_, Clock::now() - frame) + frame;
}

}  // namespace clarus::cli
