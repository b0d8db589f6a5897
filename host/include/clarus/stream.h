#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "clarus/export.h"
#include "clarus/types.h"

// What upscalers and interpolators have in common: settings, frames, and what they tell of themselves.

namespace clarus {

namespace runtime {
struct FrameResult;
}

enum class ColorSpace {
    srgb,    // display-encoded, [0, 1]; the output likewise
    linear,  // linear HDR; tone-mapped on the device for the network, the output is linear HDR again
};

/// What a depth image holds (docs/conventions.md, "Depth"). Canonical depth is neither projective nor reversed.
struct DepthEncoding {
    bool projective = false;  // a depth buffer's value, see FrameDescription::near_plane; else linear in view distance
    bool reversed = false;    // 1 is nearest
};

/// What a motion image holds (docs/conventions.md, "Motion"). In render pixels, to the previous frame and y down after
/// multiplication by `scale`: uv vectors that point from the previous frame with y up have scale {-width, +height}.
struct MotionEncoding {
    Vec2 scale{1, 1};
    bool jittered = false;           // the camera's jitter is inside the values (ENSS eq. 1)
    bool sampled_at_jitter = false;  // rasterised with jitter; false: values belong to pixel centres
};

/// Settings that upscalers and interpolators share. They hold for a whole run.
struct StreamOptions {
    Precision precision = Precision::fp32;
    Tuning tuning = Tuning::stored;
    ColorSpace color_space = ColorSpace::srgb;
    DepthEncoding depth;
    MotionEncoding motion;
    ImageFormat color_format{ElementType::f32, 3};   // ≥ 3 channels, any type
    ImageFormat depth_format{ElementType::f32, 1};   // ≥ 1 channel, any type
    ImageFormat motion_format{ElementType::f32, 2};  // ≥ 2 channels; f16 or f32
    /// Of motion images, where it is not the frame's render size: vectors that were drawn at another resolution, such
    /// as the output's, for every frame. A render pixel takes the vector at its centre. `motion.scale` makes render
    /// pixels of them.
    std::optional<Size> motion_size;
    /// Of FrameDescription::exposure_image, ≥ 1 channel of which the first is read, any type. Linear colour alone, on
    /// one device; where set, every frame brings it.
    std::optional<ImageFormat> exposure_format;
    /// Whether each frame's exposure is made from what its colours are (docs/integrating.md, "Exposure"). Linear colour
    /// alone, on one device, not with exposure_format.
    bool automatic_exposure = false;
    /// Of FrameDescription::reactive_mask and transparency_mask, ≥ 1 channel of which the first is read, any type.
    /// Upscalers alone; where set, frames may bring that mask, and those that do not have one of zeros.
    std::optional<ImageFormat> reactive_format, transparency_format;
    /// Of FrameDescription::opaque_color, ≥ 3 channels, any type. Upscalers alone; where set, every frame brings it.
    std::optional<ImageFormat> opaque_format;
    /// Of FrameDescription::ui, 4 channels, any type; where set, frames may bring it. Over display-encoded output
    /// alone: over linear output it comes after the display's tone curve.
    std::optional<ImageFormat> ui_format;
    ImageFormat output_format{ElementType::f32, 3};  // 3 channels, or 4 with alpha, 1 unless told; u8, f16 or f32
    bool profile = false;                            // time every stage with device events
    /// Which device makes what, where Device::open was given several: "auto", which measures in `prepare` and takes
    /// what makes most frames a second; or rules between commas, "PATTERN=DEVICE", of which the last that fits a
    /// stage's name (StageProfile::name) counts. In a pattern * stands for any characters; DEVICE is a class of one of
    /// the devices, or its number from 0, and device 0 makes what no rule names.
    std::string placement = "auto";
    /// Where Device::open was given several: when one fails, in `submit` or later, `submit` moves its stages to the
    /// first of the others, compiles them there, and goes on without history. A frame whose event failed is to be
    /// submitted again. Without, such a failure is an error that names the device.
    bool fallback = false;
    /// Whether frames may be rendered smaller than the render size (FrameDescription::render_size). Takes memory for a
    /// copy of the history.
    bool dynamic_resolution = false;
};

/// What a frame's images were rendered with.
struct FrameParameters {
    Vec2 jitter;         // render pixels, |x|, |y| ≤ 1: the sample of pixel (i, j) is at (i + ½ + x, j + ½ + y)
    float exposure = 1;  // linear input only; > 0; with an exposure_image or automatic exposure, a factor of theirs
    /// Seconds since the frame before, ≥ 0: what adapts over time, as automatic exposure does, does so by it.
    float frame_seconds = 1.0f / 60;
    float near_plane = 0;  // view distances, for projective depth only: 0 < near < far; far may be infinity
    float far_plane = 0;
    bool reset = false;  // a cut: history is dropped before the frame. The first frame always resets
    struct Camera {
        std::array<float, 16> view{}, projection{};  // row-major, without jitter
        float near_plane = 0, far_plane = 0, fov_y = 0;
    };
    std::optional<Camera> camera;
};

/// One frame. Inputs at render resolution, the output at output resolution; each may be a part of a larger image
/// (Image::origin). Host memory must stay valid until the
/// returned event completes.
struct FrameDescription : FrameParameters {
    /// This frame's render size, where options.dynamic_resolution is set: at most the upscaler's along each side; {0,
    /// 0}: the upscaler's. A change waits for nothing, compiles nothing and allocates nothing; the history is
    /// resampled.
    Size render_size;
    /// This frame's scale in place of options.motion.scale: uv vectors need it where the render size changes.
    std::optional<Vec2> motion_scale;
    Image color;
    Image depth;   // may be empty where Upscaler::needs_depth() is false
    Image motion;  // likewise, needs_motion()
    /// One pixel, by which `exposure` is multiplied; what is not a finite number above 0 is taken as 1. For engines
    /// that have it on the device alone.
    Image exposure_image;
    Image output;
    std::span<const cl_event> wait_for;  // the caller's events that inputs and output depend on

    /// At render size: how much of each pixel comes from this frame alone, from 0 (as the model wants it) to 1
    /// (docs/integrating.md, "Masks"). Of the two the larger counts. Errors: invalid_argument, where the options do not
    /// name a mask's format. Models that keep nothing of earlier frames need none and read none.
    Image reactive_mask, transparency_mask;
    /// At render size, encoded as `color` is: the frame before what is transparent was drawn. Where `color` differs
    /// from it, a reactive mask is made (docs/integrating.md, "Masks").
    Image opaque_color;
    /// At output size, display-encoded, colours multiplied by their alpha: user interface, drawn over the output alone,
    /// last of all; nothing that is kept for later frames has it.
    Image ui;
};

/// Device memory, in bytes.
struct MemoryRequirements {
    size_t weights = 0;          // packed weights of every kernel
    size_t arena = 0;            // intermediates and recurrent state, shared by lifetime
    size_t peak_live_bytes = 0;  // the sum of the tensors live at the worst moment, unpadded: the floor for `arena`
    size_t staging = 0;          // copies of host images and image objects, views kept
    size_t total() const { return weights + arena + staging; }
    MemoryRequirements& operator+=(const MemoryRequirements& other) {
        weights += other.weights;
        arena += other.arena;
        peak_live_bytes += other.peak_live_bytes;
        staging += other.staging;
        return *this;
    }
};

/// One stage's share of the frames since the last `take_profile`.
struct StageProfile {
    struct Span {
        int frame;          // since the last `take_profile`
        double start, end;  // in seconds on the host's steady clock, to within what it takes to enqueue a command
    };
    std::string name;         // "convolution 1", "warp", …
    std::string kernel;       // the implementation and its parameters
    int device = 0;           // its number among the Device's; −1: a transfer between two
    double seconds = 0;       // median over the frames, from device events
    double operations = 0;    // floating-point operations a frame of the largest size, as the plain definition counts
    double bytes = 0;         // bytes a frame that must be read and written, each tensor once
    std::vector<Span> spans;  // one a launch; a stage is launched once a frame, or for each band of rows
};

/// Stages that one of several devices runs one after the other (StreamOptions::placement).
struct PlacedPart {
    /// What it reads that another part made.
    struct Input {
        int part;           // that made it, by its place in Upscaler::placement
        std::string value;  // the name of the stage, and " in bytes" where it is rounded to be copied
        int frames_ago;     // 0: of the same frame; 1: of the frame before
        size_t bytes;
    };
    int device = 0;                   // its number
    std::vector<std::string> stages;  // StageProfile::name
    double seconds = 0;               // a frame, as "auto" has measured; 0 where rules placed it
    size_t bytes_in = 0;              // a frame, of what other devices made
    std::vector<Input> inputs;
};

/// What a submitted frame leaves behind. A handle; copies mean the same frame.
class CLARUS_API FrameEvent {
  public:
    explicit FrameEvent(std::shared_ptr<const runtime::FrameResult> result);
    /// Waits until the output is there and the inputs may be reused. Errors: device.
    void wait() const;
    /// Waits at most so long; whether the output is there. For what may never come, where an event of
    /// FrameDescription::wait_for does not complete. Errors: as wait.
    bool wait_for(std::chrono::duration<double> longest) const;
    /// For wait lists of the caller's own commands; to be retained by whoever outlives this handle.
    cl_event get() const;
    /// Invalid motion vectors of the frame (0 on a reset frame). Waits.
    unsigned invalid_motion_vectors() const;

  private:
    std::shared_ptr<const runtime::FrameResult> result_;
};

}  // namespace clarus
