#include "cli/shared_source.h"

#include <algorithm>
#include <deque>
#include <exception>
#include <iterator>
#include <thread>
#include <utility>

#include "base/error.h"
#include "base/log.h"
#include "cli/interrupt.h"
#include "cli/share_error.h"
#include "cli/trace.h"

namespace clarus::cli {
namespace {

constexpr int kGivenUpMilliseconds = 1000;

std::shared_ptr<clarus_share_reader> open_reader(const std::string& name) {
    clarus_share_reader* reader = nullptr;
    const clarus_share_status status = clarus_share_reader_open(name.c_str(), &reader);
    if (status != CLARUS_SHARE_OK) fail_with_share(status);
    return {reader, clarus_share_reader_close};
}

ImageFormat format_of(const clarus_share_resource& resource) {
    return {static_cast<ElementType>(resource.format.type), resource.format.channels};
}

std::shared_ptr<const SharedStream> describe(std::shared_ptr<clarus_share_reader> reader) {
    const clarus_share_description& from = *clarus_share_reader_description(reader.get());
    const clarus_share_resource& color = from.resources[CLARUS_SHARE_COLOR];
    const clarus_share_resource& depth = from.resources[CLARUS_SHARE_DEPTH];
    const clarus_share_resource& motion = from.resources[CLARUS_SHARE_MOTION];
    const auto stream = std::make_shared<SharedStream>();
    stream->sequence.render_size = {color.width, color.height};
    stream->sequence.scale = from.scale;
    stream->sequence.color_space = from.linear_color ? ColorSpace::linear : ColorSpace::srgb;
    stream->sequence.depth = {from.depth_projective != 0, from.depth_reversed != 0};
    if (from.output_width != 0) stream->sequence.shown_size = Size{from.output_width, from.output_height};
    stream->motion = {
        {from.motion_scale_x, from.motion_scale_y}, from.motion_jittered != 0, from.motion_sampled_at_jitter != 0};
    stream->color_format = format_of(color);
    stream->has_depth = depth.width != 0;
    stream->has_motion = motion.width != 0;
    if (stream->has_depth) stream->depth_format = format_of(depth);
    if (stream->has_motion) stream->motion_format = format_of(motion);
    const auto optional_format = [&](clarus_share_kind kind) -> std::optional<ImageFormat> {
        if (from.resources[kind].width == 0) return std::nullopt;
        return format_of(from.resources[kind]);
    };
    stream->reactive_format = optional_format(CLARUS_SHARE_REACTIVE_MASK);
    stream->transparency_format = optional_format(CLARUS_SHARE_TRANSPARENCY_MASK);
    stream->opaque_format = optional_format(CLARUS_SHARE_OPAQUE_COLOR);
    stream->ui_format = optional_format(CLARUS_SHARE_UI);
    for (const auto kind : {CLARUS_SHARE_HUDLESS_COLOR, CLARUS_SHARE_EXPOSURE, CLARUS_SHARE_DISTORTION})
        if (from.resources[kind].width != 0) stream->unread.emplace_back(clarus_share_kind_name(kind));
    stream->is_dynamic = from.dynamic_resolution != 0;
    stream->is_newest = from.policy == CLARUS_SHARE_NEWEST_FRAME;
    stream->reader = std::move(reader);
    return stream;
}

Image image_of(const clarus_share_image& image) {
    if (!image.pixels) return {};
    return {.host = image.pixels, .row_pitch = image.row_pitch, .size = {image.width, image.height}};
}

}  // namespace

// What `figures` tells.
class SharedSource::Log {
  public:
    void connected() {
        const std::lock_guard lock(mutex_);
        figures_.connected = true;
        ++figures_.connections;
    }
    void left() {
        const std::lock_guard lock(mutex_);
        figures_.connected = false;
    }
    void taken(uint64_t skipped) {
        const std::lock_guard lock(mutex_);
        figures_.skipped += skipped;
    }
    void let_go(Clock::time_point taken) {
        const std::lock_guard lock(mutex_);
        ++figures_.frames;
        last_.push_back({taken, Clock::now()});
        if (last_.size() > 64) last_.pop_front();
    }
    Figures figures() {
        const std::lock_guard lock(mutex_);
        Figures result = figures_;
        for (const Held& held : last_)
            result.milliseconds += std::chrono::duration<double, std::milli>(held.until - held.from).count();
        if (last_.empty()) return result;
        result.milliseconds /= static_cast<double>(last_.size());
        const double seconds = std::chrono::duration<double>(last_.back().until - last_.front().until).count();
        if (seconds > 0) result.frames_per_second = static_cast<double>(last_.size() - 1) / seconds;
        return result;
    }

  private:
    struct Held {
        Clock::time_point from, until;
    };
    std::mutex mutex_;
    Figures figures_;
    std::deque<Held> last_;
};

SharedSource::SharedSource(std::string name, bool goes_on)
    : name_(std::move(name)), goes_on_(goes_on), log_(std::make_shared<Log>()) {
    open_reader(name_);  // so that a name that cannot be is refused at once
}

bool SharedSource::connect() {
    while (!Interrupt::came()) {
        // A reader of its own for each connection: frames of the last one are let go when they are done.
        std::shared_ptr<clarus_share_reader> reader = open_reader(name_);
        clarus_share_status status = CLARUS_SHARE_NO_STREAM;
        while (status == CLARUS_SHARE_NO_STREAM || status == CLARUS_SHARE_TIMED_OUT || status == CLARUS_SHARE_GONE) {
            if (Interrupt::came()) return false;
            status = clarus_share_reader_connect(reader.get(), Interrupt::look_milliseconds);
        }
        if (status == CLARUS_SHARE_OK && is_met(std::move(reader))) return true;
        if (status == CLARUS_SHARE_OK) continue;
        if (!goes_on_) fail_with_share(status);
        give_up(clarus_share_last_error());
    }
    return false;
}

bool SharedSource::is_met(std::shared_ptr<clarus_share_reader> reader) {
    stream_ = describe(std::move(reader));
    try {
        if (prepare_) prepare_();
    } catch (const std::exception& error) {
        if (Interrupt::came()) return false;
        if (!goes_on_) throw;
        refuse(error.what());
        give_up(error.what());
        return false;
    }
    log_->connected();
    return true;
}

// Says so once, and leaves the renderer some time to go.
void SharedSource::give_up(const std::string& why) {
    if (why != trouble_) log(LogLevel::warning, "{}; waiting for another renderer of {}", why, name_);
    trouble_ = why;
    for (int waited = 0; waited < kGivenUpMilliseconds && !Interrupt::came(); waited += Interrupt::look_milliseconds)
        std::this_thread::sleep_for(std::chrono::milliseconds(Interrupt::look_milliseconds));
}

bool SharedSource::waits() const {
    clarus_share_reader* reader = stream_->reader.get();
    return stream_->is_newest || !clarus_share_reader_ready(reader) || !clarus_share_reader_state(reader).connected;
}

SourceFrame SharedSource::frame_of(const clarus_share_frame& shared, uint64_t skipped) const {
    SourceFrame frame;
    frame.name = frame_name(shared.number);
    frame.number = shared.number;
    FrameDescription& inputs = frame.inputs;
    inputs.jitter = {shared.jitter_x, shared.jitter_y};
    inputs.exposure = shared.exposure;
    inputs.near_plane = shared.near_plane;
    inputs.far_plane = shared.far_plane;
    inputs.reset = shared.reset != 0;
    if (shared.has_matrices) {
        FrameParameters::Camera& camera = inputs.camera.emplace();
        std::copy(std::begin(shared.view), std::end(shared.view), camera.view.begin());
        std::copy(std::begin(shared.projection), std::end(shared.projection), camera.projection.begin());
        camera.near_plane = shared.near_plane;
        camera.far_plane = shared.far_plane;
        camera.fov_y = shared.fov_y;
    }
    inputs.render_size = {shared.width, shared.height};
    inputs.motion_scale = Vec2{shared.motion_scale_x, shared.motion_scale_y};
    inputs.color = image_of(shared.images[CLARUS_SHARE_COLOR]);
    inputs.depth = image_of(shared.images[CLARUS_SHARE_DEPTH]);
    inputs.motion = image_of(shared.images[CLARUS_SHARE_MOTION]);
    inputs.reactive_mask = image_of(shared.images[CLARUS_SHARE_REACTIVE_MASK]);
    inputs.transparency_mask = image_of(shared.images[CLARUS_SHARE_TRANSPARENCY_MASK]);
    inputs.opaque_color = image_of(shared.images[CLARUS_SHARE_OPAQUE_COLOR]);
    inputs.ui = image_of(shared.images[CLARUS_SHARE_UI]);
    if (shared.frame_seconds > 0)
        frame.seconds = std::min(60.0, shared.frame_seconds * static_cast<double>(skipped + 1));
    frame.hold =
        std::shared_ptr<const void>(stream_.get(), [stream = stream_, log = log_, taken = Clock::now()](const void*) {
            clarus_share_reader_release(stream->reader.get());
            log->let_go(taken);
        });
    return frame;
}

std::optional<SourceFrame> SharedSource::next() {
    while (!Interrupt::came()) {
        clarus_share_reader* reader = stream_->reader.get();
        const uint64_t skipped = clarus_share_reader_state(reader).skipped;
        clarus_share_frame shared;
        const clarus_share_status status = clarus_share_reader_wait(reader, Interrupt::look_milliseconds, &shared);
        if (status == CLARUS_SHARE_OK) {
            const uint64_t left_out = clarus_share_reader_state(reader).skipped - skipped;
            log_->taken(left_out);
            return frame_of(shared, left_out);
        }
        if (status == CLARUS_SHARE_TIMED_OUT) continue;
        log_->left();
        if (status == CLARUS_SHARE_ENDED && !goes_on_) return std::nullopt;
        const bool left_well = status == CLARUS_SHARE_ENDED || status == CLARUS_SHARE_GONE;
        if (!left_well && !goes_on_) fail_with_share(status);
        log(left_well ? LogLevel::info : LogLevel::warning, "{}; waiting for the next", clarus_share_last_error());
        if (!connect()) return std::nullopt;
    }
    return std::nullopt;
}

void SharedSource::refuse(const std::string& why) {
    if (stream_) clarus_share_reader_refuse(stream_->reader.get(), why.c_str());
}

SharedSource::Figures SharedSource::figures() const { return log_->figures(); }

}  // namespace clarus::cli
