#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "clarus/device.h"
#include "clarus/export.h"
#include "clarus/stream.h"

namespace clarus {

using InterpolatorOptions = StreamOptions;

/// Makes the frame in the middle between each frame shown and the one before it, without a network, from motion and
/// depth (docs/interpolate.md). To be given what an upscaler has made of a frame, before user interface is drawn on it:
/// that has no motion, and belongs on the frames in between as on the others. Not thread-safe, as Upscaler is not.
class CLARUS_API Interpolator {
  public:
    /// `render_size` is that of depth and motion, `output_size` that of the pictures, not smaller along either axis.
    /// Plans; allocates and compiles nothing yet. Errors: invalid_argument (sizes, options).
    Interpolator(Device device, Size render_size, Size output_size, InterpolatorOptions options = {});
    ~Interpolator();
    Interpolator(Interpolator&&) noexcept;
    Interpolator& operator=(Interpolator&&) noexcept;

    Size render_size() const;
    Size output_size() const;
    /// The same, for frames of this size. Errors: invalid_argument where they cannot be.
    Size output_size(Size render_size) const;

    /// Device memory; staging is for host images and image objects, and is allocated when the first comes.
    MemoryRequirements memory_requirements() const;

    /// Compiles, tunes where the options say so, and allocates. `submit` does it where it was not done. `progress` is
    /// called with 0…1. Errors: build, out_of_memory, device.
    void prepare(const std::function<void(double)>& progress = {});

    /// Enqueues the frame in between and returns at once. Of the description, `color` is this frame as it is shown, at
    /// output resolution; `depth`, `motion`, `jitter`, the planes and `exposure` are what the upscaler had of it; and
    /// `output`, at output resolution, receives the frame half-way between the one submitted before and this one. After
    /// a reset, as before the first frame, there is nothing to come from: it is this frame. A copy of `color` is kept
    /// on the device for the next call. Errors: invalid_argument, naming the field.
    FrameEvent submit(const FrameDescription& frame);

    /// The next frame has none before it.
    void reset();

    /// Upscaler::save_history and restore_history, of the frame before.
    std::vector<std::byte> save_history() const;
    void restore_history(std::span<const std::byte> history);

    /// Stages with their times since the last call; empty unless options.profile.
    std::vector<StageProfile> take_profile();

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace clarus
