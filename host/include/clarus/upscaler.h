#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "clarus/device.h"
#include "clarus/model.h"
#include "clarus/types.h"

namespace clarus {

namespace runtime {
struct FrameResult;
}

enum class ColorSpace {
    srgb,    // display-encoded, [0, 1]; the output likewise
    linear,  // linear HDR; tone-mapped on the device for the network, the output is linear HDR again
};

/// What a depth image holds (conventions.md, "Depth"). Canonical depth is neither projective nor reversed.
struct DepthEncoding {
    bool projective = false;  // a depth buffer's value, see FrameDescription::near_plane; else linear in view distance
    bool reversed = false;    // 1 is nearest
};

/// What a motion image holds (conventions.md, "Motion"). In render pixels, to the previous frame and y down after
/// multiplication by `scale`: uv vectors that point from the previous frame with y up have scale {-width, +height}.
struct MotionEncoding {
    Vec2 scale{1, 1};
    bool jittered = false;           // the camera's jitter is inside the values (ENSS eq. 1)
    bool sampled_at_jitter = false;  // rasterised with jitter; false: values belong to pixel centres
};

/// Antialiasing of images with one sample a pixel: `mlaa` is morphological (Reshetov 2009).
enum class Antialiasing { none, mlaa };

/// Settings that upscalers and interpolators share. They hold for a whole run.
struct StreamOptions {
    Precision precision = Precision::fp32;
    Tuning tuning = Tuning::stored;
    ColorSpace color_space = ColorSpace::srgb;
    DepthEncoding depth;
    MotionEncoding motion;
    ImageFormat color_format{ElementType::f32, 3};   // ≥ 3 channels
    ImageFormat depth_format{ElementType::f32, 1};   // ≥ 1 channel
    ImageFormat motion_format{ElementType::f32, 2};  // ≥ 2 channels; f16 or f32
    ImageFormat output_format{ElementType::f32, 3};  // 3 channels, or 4 with alpha 1
    bool profile = false;                            // time every stage with device events
    /// Whether frames may be rendered smaller than the render size (FrameDescription::render_size). Takes memory for a
    /// copy of the history.
    bool dynamic_resolution = false;
};

struct UpscalerOptions : StreamOptions {
    /// Where the images between layers would be large, layers take turns on bands of so many rows of the output, so
    /// that little of those images is there at a time: fewer rows take less memory and more launches. 0: 32, where
    /// whole images would be large for the device.
    int band_rows = 0;
    /// Of the output, in pixels, from 1 to 2^15 a side; where not set, each frame's render size times the model's
    /// scale. Where
    /// it is another, the model's result is resampled to it, each axis by its own ratio: enlarged by a bicubic filter
    /// without overshoot, at most four times, or reduced to the mean of what each pixel covers, at most to a quarter.
    /// What the model keeps for later frames stays as it is.
    std::optional<Size> output_size;
    Antialiasing antialias_input = Antialiasing::none;  // of the colour that the model sees
    Antialiasing antialias = Antialiasing::none;        // of the output; what the model keeps of it stays as it is
    /// Of the output, last: β of MNSS's step 6, from 0 (off) to 1. What the model keeps stays as it is.
    float sharpen = 0;
    /// By name, what else the model's pipeline lets choose: Model::options lists it. What is not named has its usual
    /// value.
    std::map<std::string, double> pipeline_options;
    std::vector<std::string> views;  // intermediates to keep readable (Upscaler::view), see Upscaler::view_names
};

/// What a frame's images were rendered with.
struct FrameParameters {
    Vec2 jitter;           // render pixels, |x|, |y| ≤ 1: the sample of pixel (i, j) is at (i + ½ + x, j + ½ + y)
    float exposure = 1;    // linear input only; > 0
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
/// returned event completes. Optional resources are accepted and checked for size; a pipeline ignores what it does not
/// use (at present all of them).
struct FrameDescription : FrameParameters {
    /// Of this frame, where the resolution is dynamic: up to the upscaler's along each side; {0, 0} is that. A change
    /// waits for nothing, compiles nothing and allocates nothing; the history is resampled and stays.
    Size render_size;
    /// In place of options.motion.scale, which is for vectors in pixels, or for uv vectors of the upscaler's render
    /// size.
    std::optional<Vec2> motion_scale;
    Image color;
    Image depth;   // may be empty where Upscaler::needs_depth() is false
    Image motion;  // likewise, needs_motion()
    Image output;
    std::span<const cl_event> wait_for;  // the caller's events that inputs and output depend on

    Image reactive_mask, transparency_mask, opaque_color, hudless_color, ui;
};

/// Device memory, in bytes.
struct MemoryRequirements {
    size_t weights = 0;          // packed weights of every kernel
    size_t arena = 0;            // intermediates and recurrent state, shared by lifetime
    size_t peak_live_bytes = 0;  // the sum of the tensors live at the worst moment, unpadded: the floor for `arena`
    size_t staging = 0;          // copies of host images on the device, views kept
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
        double start, end;  // in seconds on the device's clock
    };
    std::string name;         // "convolution 1", "warp", …
    std::string kernel;       // the implementation and its parameters
    double seconds = 0;       // median over the frames, from device events
    double operations = 0;    // floating-point operations a frame, counted as the plain definition's
    double bytes = 0;         // bytes a frame that must be read and written, each tensor once
    std::vector<Span> spans;  // one a launch; a stage is launched once a frame, or for each band of rows
};

/// What a submitted frame leaves behind. A handle; copies mean the same frame.
class FrameEvent {
  public:
    explicit FrameEvent(std::shared_ptr<const runtime::FrameResult> result);
    /// Waits until the output is there and the inputs may be reused. Errors: device.
    void wait() const;
    /// For wait lists of the caller's own commands; to be retained by whoever outlives this handle.
    cl_event get() const;
    /// Invalid motion vectors of the frame (0 on a reset frame). Waits.
    unsigned invalid_motion_vectors() const;

  private:
    std::shared_ptr<const runtime::FrameResult> result_;
};

/// Runs one model on one stream of frames. Not thread-safe: one thread at a time; several upscalers are independent,
/// also on one Device if their calls do not overlap.
class Upscaler {
  public:
    /// Plans; allocates and compiles nothing yet. Errors: invalid_argument (sizes, options), file (a model whose
    /// tensors do not fit its pipeline).
    Upscaler(Device device, Model model, Size render_size, UpscalerOptions options = {});
    ~Upscaler();
    Upscaler(Upscaler&&) noexcept;
    Upscaler& operator=(Upscaler&&) noexcept;

    Size render_size() const;
    /// UpscalerOptions::output_size, or else the render size times the model's scale, sides rounded to the nearest.
    Size output_size() const;
    /// Of a frame's. Errors: invalid_argument where it is larger than the upscaler's, or too small for the output size.
    Size output_size(Size render_size) const;

    /// Whether frames must bring depth or motion: false for what looks at one frame's colour alone.
    bool needs_depth() const;
    bool needs_motion() const;

    /// Device memory with the kernels chosen so far; `Tuning::measure` may choose others in `prepare`. Staging is for
    /// host images, and is allocated when the first comes.
    MemoryRequirements memory_requirements() const;

    /// Compiles, tunes where the options say so, allocates and uploads weights. `submit` does it where it was not done.
    /// `progress` is called with 0…1. Errors: build, out_of_memory, device.
    void prepare(const std::function<void(double)>& progress = {});

    /// Enqueues one frame and returns at once. Errors: invalid_argument, naming the field.
    FrameEvent submit(const FrameDescription& frame);

    /// Drops history: the next frame starts anew.
    void reset();

    /// Names of intermediates that can be asked for in UpscalerOptions::views ("alpha", "warped", …).
    std::vector<std::string> view_names() const;

    /// A view of the last submitted frame as interleaved floats. Waits.
    struct View {
        Size size;
        int channels = 0;
        std::vector<float> pixels;
        bool maps = false;  // each channel is a picture of its own, even where two could be a vector, three a colour
    };
    View view(const std::string& name) const;

    /// The most that a frame's jitter was away from the nearest jitter that the model has kernels for, in render
    /// pixels. Beyond 0.01 the model is not used as it was trained (pipelines.md, "Jitter-conditioned kernels"); the
    /// destructor then says so to the log callback, once.
    double largest_jitter_distance() const;

    /// Stages with their times since the last call; empty unless options.profile.
    std::vector<StageProfile> take_profile();

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace clarus
