#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "clarus/device.h"
#include "clarus/export.h"
#include "clarus/model.h"
#include "clarus/stream.h"
#include "clarus/types.h"

namespace clarus {

/// Antialiasing of images with one sample a pixel: `mlaa` is morphological (Reshetov 2009).
enum class Antialiasing { none, mlaa };

struct UpscalerOptions : StreamOptions {
    /// Where the images between layers would be large, layers take turns on bands of so many rows of the output, so
    /// that little of those images is there at a time: fewer rows take less memory and more launches. 0: 32, where
    /// whole images would be large for the device.
    int band_rows = 0;
    /// Of the output, in pixels, from 1 to 2^15 a side; where not set, each frame's render size times the model's
    /// scale. Where it is another, the model's result is resampled to it, each axis by its own ratio: enlarged by a
    /// bicubic filter without overshoot, at most four times, or reduced to the mean of what each pixel covers, at most
    /// to a quarter. What the model keeps for later frames stays as it is.
    std::optional<Size> output_size;
    Antialiasing antialias_input = Antialiasing::none;  // of the colour that the model sees
    Antialiasing antialias = Antialiasing::none;        // of the output; what the model keeps of it stays as it is
    /// Of the output, last: β of MNSS's step 6, from 0 (off) to 1. What the model keeps stays as it is.
    float sharpen = 0;
    /// Whether colour's fourth component is upscaled beside it and is the output's, which has four then: by a bicubic
    /// filter, clamped to [0, 1], the jitter taken out where the model takes it out of colour. Without, models see the
    /// first three alone, and a fourth of the output is 1.
    bool alpha = false;
    /// By name, what else the model's pipeline lets choose: Model::options lists it. What is not named has its usual
    /// value.
    std::map<std::string, double> pipeline_options;
    /// Whether the first frames are held against what the options and their jitter declare, to find a wrong sign or
    /// unit while one integrates (docs/checking.md, "In the library"). They are copied to the host, for which `submit`
    /// waits; a thread with what time others leave looks at them, and logs one warning of what is surely wrong. Nothing
    /// where the model reads no motion.
    bool diagnose = false;
    std::vector<std::string> views;  // intermediates to keep readable (Upscaler::view), see Upscaler::view_names
};

/// Runs one model on one stream of frames. Not thread-safe: one thread at a time. Several upscalers are independent,
/// also on one Device: each has queues of its own there, so that devices take their frames in turns, as they are ready;
/// but on a Device that was adopted with an in-order queue, where frames of all go one after the other and their calls
/// must not overlap.
class CLARUS_API Upscaler {
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
    /// host images and image objects, and is allocated when the first comes.
    MemoryRequirements memory_requirements() const;

    /// Compiles, tunes where the options say so, allocates and uploads weights. `submit` does it where it was not done.
    /// `progress` is called with 0…1. Errors: build, out_of_memory, device.
    void prepare(const std::function<void(double)>& progress = {});

    /// Enqueues one frame and returns at once. Errors: invalid_argument, naming the field.
    FrameEvent submit(const FrameDescription& frame);

    /// Drops history: the next frame starts anew.
    void reset();

    /// Whether the model keeps anything of earlier frames: false for what looks at one frame alone.
    bool keeps_history() const;
    /// What the upscaler keeps of earlier frames for the next, as bytes for `restore_history`: in another process, too,
    /// of the same version of Clarus. After `reset` and before the first frame there is nothing, which is bytes as
    /// well. Waits for the frames that were submitted. Errors: device.
    std::vector<std::byte> save_history() const;
    /// Goes on after the frame that was the last when another one saved it: the next frame's output is the same to the
    /// last bit, on the same device, by the same kernels; where these are others, the log says so. Prepares. Errors:
    /// invalid_argument where the bytes are no history, or that of another model, precision, size or way to share out
    /// stages; what is kept then is as after `reset`; those of `prepare`.
    void restore_history(std::span<const std::byte> history);

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
    /// pixels. Beyond 0.01 the model is not used as it was trained (docs/pipelines.md, "Jitter-conditioned kernels");
    /// the destructor then says so to the log callback, once.
    double largest_jitter_distance() const;

    /// How the stages are shared out among several devices, part by part; empty of one device. Before `prepare` has
    /// measured, what "auto" starts from.
    std::vector<PlacedPart> placement() const;
    /// What the stages of a frame would take on each of several devices alone, in seconds, as "auto" has measured them;
    /// empty before that, and where rules place.
    std::vector<double> seconds_alone() const;

    /// Stages with their times since the last call; empty unless options.profile.
    std::vector<StageProfile> take_profile();

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace clarus
