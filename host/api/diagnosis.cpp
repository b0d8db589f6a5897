#include "api/diagnosis.h"

#include <chrono>
#include <exception>
#include <string>
#include <utility>

#include "api/stored_values.h"
#include "base/error.h"
#include "base/log.h"
#include "check/first_frames.h"
#include "cl/event.h"

namespace clarus {

namespace {

/// As ingest takes them (StreamOptions::motion_size).
io::Pixels at_render_pixels(io::Pixels motion, Size render) {
    if (motion.values.empty() || motion.size == render) return motion;
    io::Pixels taken{render, 2, {}};
    for (int y = 0; y < render.height; ++y)
        for (int x = 0; x < render.width; ++x)
            for (int c = 0; c < 2; ++c)
                taken.values.push_back(motion.at((2 * x + 1) * motion.size.width / (2 * render.width),
                                                 (2 * y + 1) * motion.size.height / (2 * render.height), c));
    return taken;
}

}  // namespace

// Vectors are kept as options.motion.scale makes them: in render pixels, to the previous frame, y down.
Diagnosis::Diagnosis(const UpscalerOptions& options, Size render, double scale, bool needs_depth)
    : options_(options), needs_depth_(needs_depth) {
    film_.sequence.render_size = render;
    film_.sequence.scale = scale;
    film_.sequence.color_space = options.color_space;
    film_.sequence.depth = options.depth;
    film_.sequence.motion.jittered = options.motion.jittered;
    film_.sequence.motion.sampled_at_jitter = options.motion.sampled_at_jitter;
}

Diagnosis::~Diagnosis() {
    if (!is_full_) try {
            look();
        } catch (const std::exception&) {  // there is no thread or memory to be had
        }
}

void Diagnosis::add(const FrameDescription& frame, const ocl::Context& context) noexcept {
    if (is_full_) return;
    try {
        take(frame, context);
        if (is_full_) look();
    } catch (const std::exception& error) {
        is_full_ = true;
        log(LogLevel::warning, "options.diagnose: the first frames cannot be looked at: {}", error.what());
    }
}

void Diagnosis::take(const FrameDescription& frame, const ocl::Context& context) {
    if (frame.color.size != film_.sequence.render_size) {
        is_full_ = true;
        return;
    }
    // An event that the caller completes later is not to be waited for.
    if (!ocl::wait_at_most(frame.wait_for, std::chrono::seconds(1)))
        fail(ErrorKind::invalid_argument, "an event of frame.wait_for does not complete within a second");
    const auto values = [&](const Image& image, const ImageFormat& format, int channels) {
        return image.empty() ? io::Pixels() : stored_values(image, format, channels, context);
    };
    io::FramePixels pixels;
    pixels.color = values(frame.color, options_.color_format, 3);
    if (needs_depth_) pixels.depth = values(frame.depth, options_.depth_format, 1);
    pixels.motion = at_render_pixels(values(frame.motion, options_.motion_format, 2), frame.color.size);
    const Vec2 scale = frame.motion_scale.value_or(options_.motion.scale);
    for (size_t i = 0; i < pixels.motion.values.size(); i += 2) {
        pixels.motion.values[i] *= scale.x;
        pixels.motion.values[i + 1] *= scale.y;
    }
    io::FrameFiles described;
    static_cast<FrameParameters&>(described) = frame;
    described.reset |= std::exchange(is_cut_, false);
    film_.sequence.frames.push_back(std::move(described));
    film_.add(std::move(pixels));
    is_full_ = film_.luma.size() == check::most_first_frames;
}

void Diagnosis::look() {
    if (film_.luma.size() < check::fewest_first_frames) return;
    looking_ = std::async(std::launch::async, [film = std::exchange(film_, {})] {
        const std::string wrong = check::surely_wrong(film);
        if (wrong.empty())
            log(LogLevel::info, "options.diagnose: nothing is surely wrong in the first {} frames", film.luma.size());
        else
            log(LogLevel::warning,
                "options.diagnose: in the first frames, {}. Motion is taken as options.motion.scale makes it: in "
                "render "
                "pixels, to the previous frame, y down (docs/conventions.md)",
                wrong);
    });
}

}  // namespace clarus
