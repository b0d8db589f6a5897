#include "clarus/upscaler.h"

#include <fmt/format.h>
#include <nanobind/stl/map.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/variant.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <mutex>
#include <optional>
#include <utility>
#include <variant>

#include "arrays.h"
#include "clarus/error.h"
#include "module.h"
#include "words.h"

namespace nb = nanobind;
using namespace nb::literals;

namespace clarus::python {
namespace {

Size size_of(Pair pair) { return {pair.first, pair.second}; }
Pair pair_of(Size size) { return {size.width, size.height}; }
Vec2 vector_of(std::pair<float, float> pair) { return {pair.first, pair.second}; }

Antialiasing antialiasing_of(const char* argument, const std::string& word) {
    return value_of<Antialiasing>(argument, word, {{"none", Antialiasing::none}, {"mlaa", Antialiasing::mlaa}});
}

Model model_of(const std::variant<std::string, Model>& model, std::optional<double> scale) {
    if (const auto* name = std::get_if<std::string>(&model)) return find_model(*name, scale);
    if (scale) throw Error(ErrorKind::invalid_argument, "scale: a Model has one; give it to Model(name, scale)");
    return std::get<Model>(model);
}

/// An upscaler with the memory that its frames are read from, which one thread uses at a time: others wait, without
/// Python's lock.
class Stream {
  public:
    Stream(Device device, const Model& model, Size render_size, UpscalerOptions options)
        : options_(std::move(options)),
          name_(model.name()),
          upscaler_(std::in_place, std::move(device), model, render_size, options_),
          render_size_(render_size),
          output_size_(upscaler_->output_size()),
          needs_depth_(upscaler_->needs_depth()),
          needs_motion_(upscaler_->needs_motion()) {}

    /// Without Python's lock, which what the upscaler still has to say may want.
    ~Stream() { close(); }
    Stream(const Stream&) = delete;
    Stream& operator=(const Stream&) = delete;

    const UpscalerOptions& options() const { return options_; }
    Size render_size() const { return render_size_; }
    Size output_size() const { return output_size_; }
    bool needs_depth() const { return needs_depth_; }
    bool needs_motion() const { return needs_motion_; }

    /// What `use` makes of the upscaler. It must touch nothing of Python's. Errors: invalid_argument after `close`.
    template <typename Use>
    auto with(Use&& use) {
        const nb::gil_scoped_release others_may_run;
        const std::lock_guard lock(mutex_);
        if (!upscaler_) throw Error(ErrorKind::invalid_argument, "this Upscaler was closed");
        return use(*upscaler_);
    }

    void close() {
        const nb::gil_scoped_release others_may_run;
        const std::lock_guard lock(mutex_);
        upscaler_.reset();
    }

    std::string text() const {
        return fmt::format("<clarus.Upscaler {}: {}x{} to {}x{}>", name_, render_size_.width, render_size_.height,
                           output_size_.width, output_size_.height);
    }

  private:
    const UpscalerOptions options_;
    const std::string name_;
    std::mutex mutex_;
    std::optional<Upscaler> upscaler_;
    const Size render_size_, output_size_;
    const bool needs_depth_, needs_motion_;
};

Input needed_input(const char* argument, nb::handle object, bool is_needed, const ImageFormat& format, Size size) {
    if (is_needed && object.is_none())
        throw Error(ErrorKind::invalid_argument, fmt::format("{}: None, but the model needs it", argument));
    return input_of(argument, object, format, size);
}

Input optional_input(const char* argument, nb::handle object, const std::optional<ImageFormat>& format, Size size) {
    if (object.is_none()) return {};
    if (!format)
        throw Error(ErrorKind::invalid_argument,
                    fmt::format("{0}: this Upscaler was made for none; with {0}_format it takes one", argument));
    return input_of(argument, object, *format, size);
}

nb::object upscale(Stream& stream, nb::handle color, nb::handle depth, nb::handle motion,
                   std::pair<float, float> jitter, bool reset, float exposure, float frame_seconds, float near_plane,
                   float far_plane, std::optional<Pair> render_size,
                   std::optional<std::pair<float, float>> motion_scale, nb::handle reactive_mask,
                   nb::handle transparency_mask, nb::handle opaque_color, nb::handle ui, nb::handle exposure_image,
                   nb::object out) {
    const UpscalerOptions& options = stream.options();
    const Size size = render_size ? size_of(*render_size) : stream.render_size();
    const Size output_size = stream.with([&](Upscaler& upscaler) { return upscaler.output_size(size); });
    const Input colors = needed_input("color", color, true, options.color_format, size);
    const Input depths = needed_input("depth", depth, stream.needs_depth(), options.depth_format, size);
    const Input motions = needed_input("motion", motion, stream.needs_motion(), options.motion_format,
                                       options.motion_size.value_or(size));
    const Input reactive = optional_input("reactive_mask", reactive_mask, options.reactive_format, size);
    const Input transparency =
        optional_input("transparency_mask", transparency_mask, options.transparency_format, size);
    const Input opaque = optional_input("opaque_color", opaque_color, options.opaque_format, size);
    const Input interface = optional_input("ui", ui, options.ui_format, output_size);
    const Input exposures = optional_input("exposure_image", exposure_image, options.exposure_format, {1, 1});
    if (out.is_none()) out = new_array(options.output_format, output_size);

    FrameDescription frame;
    frame.render_size = size;
    frame.color = colors.image;
    frame.depth = depths.image;
    frame.motion = motions.image;
    frame.reactive_mask = reactive.image;
    frame.transparency_mask = transparency.image;
    frame.opaque_color = opaque.image;
    frame.ui = interface.image;
    frame.exposure_image = exposures.image;
    frame.output = output_of("out", out, options.output_format, output_size);
    frame.jitter = vector_of(jitter);
    frame.reset = reset;
    frame.exposure = exposure;
    frame.frame_seconds = frame_seconds;
    frame.near_plane = near_plane;
    frame.far_plane = far_plane;
    if (motion_scale) frame.motion_scale = vector_of(*motion_scale);
    stream.with([&](Upscaler& upscaler) { upscaler.submit(frame).wait(); });
    return out;
}

nb::object view(Stream& stream, const std::string& name) {
    const Upscaler::View seen = stream.with([&](Upscaler& upscaler) { return upscaler.view(name); });
    nb::object array = new_array({ElementType::f32, seen.channels}, seen.size);
    std::copy(seen.pixels.begin(), seen.pixels.end(), nb::cast<nb::ndarray<float, nb::c_contig>>(array).data());
    return array;
}

constexpr const char* upscaler_help =
    R"(Runs a model on a stream of frames: docs/python.md, "Upscaler". Sizes are (width, height), formats
(element type, channels): "float32", "float16", "uint8" (255 is 1) or "uint16" (65535 is 1).

Plans; compiles and allocates nothing before prepare() or the first frame. May be used from several threads, whose
frames take turns. Raises InvalidArgumentError, FileError, NoDeviceError.)";

constexpr const char* upscale_help =
    R"(The frame at output size, rows x columns x channels: `out`, or a new array.

Arrays are what has __dlpack__ or the buffer protocol, in host memory: `color` (height, width, channels), `depth`
(height, width), `motion` (height, width, 2). They are not copied, unless pixels are not beside each other. `jitter` is
in render pixels; `motion` is of another size where the Upscaler was given one; `reset` drops history, as at a cut; the planes are for projective depth, `exposure` for linear colour;
`frame_seconds` is the time since the frame before, by which automatic exposure adapts.
`render_size` and `motion_scale` are this frame's, where they are others (dynamic_resolution). `reactive_mask` and
`transparency_mask` (height, width) are 1 where history is not to be trusted, 0 elsewhere; or `opaque_color`, the frame
without what is transparent, of which a mask is made. `ui` (premultiplied, of four channels, at output size) is drawn on
the result; `exposure_image` is one pixel in place of `exposure`.

Returns when the frame is done; other threads of Python run meanwhile. Raises InvalidArgumentError, naming the argument,
and, of the first frame as prepare() does, BuildError, OutOfMemoryError, DeviceError.)";

constexpr const char* upscale_signature =
    "def upscale(self, color: object, depth: object | None = None, motion: object | None = None, *, "
    "jitter: tuple[float, float] = (0.0, 0.0), reset: bool = False, exposure: float = 1.0, frame_seconds: float = 1 / "
    "60, near_plane: float = 0.0, "
    "far_plane: float = 0.0, render_size: tuple[int, int] | None = None, "
    "motion_scale: tuple[float, float] | None = None, reactive_mask: object | None = None, "
    "transparency_mask: object | None = None, opaque_color: object | None = None, ui: object | None = None, "
    "exposure_image: object | None = None, out: object | None = None) -> numpy.ndarray";

}  // namespace

void add_upscaler(nb::module_& module) {
    const UpscalerOptions usual;
    nb::class_<Stream>(module, "Upscaler", upscaler_help)
        .def(
            "__init__",
            [](Stream* self, const std::variant<std::string, Model>& model, Pair render_size,
               const std::variant<std::string, Device>& device, std::optional<double> scale,
               const std::string& precision, const std::string& tuning, const std::string& color_space,
               bool depth_projective, bool depth_reversed, std::pair<float, float> motion_scale, bool motion_jittered,
               bool motion_sampled_at_jitter, const Format& color_format, const Format& depth_format,
               const Format& motion_format, const std::optional<Format>& reactive_mask_format,
               const std::optional<Format>& transparency_mask_format, const std::optional<Format>& opaque_color_format,
               const std::optional<Format>& ui_format, const std::optional<Format>& exposure_image_format,
               const Format& output_format, std::optional<Pair> motion_size, bool automatic_exposure,
               std::optional<Pair> output_size, const std::string& antialias_input, const std::string& antialias,
               float sharpen, const std::map<std::string, double>& pipeline_options, bool dynamic_resolution,
               const std::string& placement, bool fallback, int band_rows, bool diagnose, bool alpha,
               const std::vector<std::string>& views) {
                UpscalerOptions options;
                options.precision = value_of<Precision>("precision", precision,
                                                        {{"fp32", Precision::fp32},
                                                         {"fp16", Precision::fp16},
                                                         {"bf16", Precision::bf16},
                                                         {"automatic", Precision::automatic}});
                options.tuning = value_of<Tuning>("tuning", tuning,
                                                  {{"stored", Tuning::stored},
                                                   {"measure", Tuning::measure},
                                                   {"fixed", Tuning::fixed},
                                                   {"obvious", Tuning::obvious}});
                options.color_space = color_space_of(color_space);
                options.depth = {depth_projective, depth_reversed};
                options.motion = {vector_of(motion_scale), motion_jittered, motion_sampled_at_jitter};
                options.color_format = format_of("color_format", color_format);
                options.depth_format = format_of("depth_format", depth_format);
                options.motion_format = format_of("motion_format", motion_format);
                if (reactive_mask_format)
                    options.reactive_format = format_of("reactive_mask_format", *reactive_mask_format);
                if (transparency_mask_format)
                    options.transparency_format = format_of("transparency_mask_format", *transparency_mask_format);
                if (opaque_color_format) options.opaque_format = format_of("opaque_color_format", *opaque_color_format);
                if (ui_format) options.ui_format = format_of("ui_format", *ui_format);
                if (exposure_image_format)
                    options.exposure_format = format_of("exposure_image_format", *exposure_image_format);
                options.output_format = format_of("output_format", output_format);
                if (motion_size) options.motion_size = size_of(*motion_size);
                options.automatic_exposure = automatic_exposure;
                if (output_size) options.output_size = size_of(*output_size);
                options.antialias_input = antialiasing_of("antialias_input", antialias_input);
                options.antialias = antialiasing_of("antialias", antialias);
                options.sharpen = sharpen;
                options.pipeline_options = pipeline_options;
                options.dynamic_resolution = dynamic_resolution;
                options.placement = placement;
                options.fallback = fallback;
                options.band_rows = band_rows;
                options.diagnose = diagnose;
                options.alpha = alpha;
                options.views = views;
                const auto* selector = std::get_if<std::string>(&device);
                new (self) Stream(selector ? Device::open(*selector) : std::get<Device>(device), model_of(model, scale),
                                  size_of(render_size), std::move(options));
            },
            "model"_a, "render_size"_a, nb::kw_only(), "device"_a = "auto", "scale"_a = nb::none(),
            "precision"_a = "fp32", "tuning"_a = "stored", "color_space"_a = "srgb", "depth_projective"_a = false,
            "depth_reversed"_a = false, "motion_scale"_a = std::pair(1.0f, 1.0f), "motion_jittered"_a = false,
            "motion_sampled_at_jitter"_a = false, "color_format"_a = std::pair("float32", 3),
            "depth_format"_a = std::pair("float32", 1), "motion_format"_a = std::pair("float32", 2),
            "reactive_mask_format"_a = nb::none(), "transparency_mask_format"_a = nb::none(),
            "opaque_color_format"_a = nb::none(), "ui_format"_a = nb::none(), "exposure_image_format"_a = nb::none(),
            "output_format"_a = std::pair("float32", 3), "motion_size"_a = nb::none(), "automatic_exposure"_a = false,
            "output_size"_a = nb::none(), "antialias_input"_a = "none", "antialias"_a = "none",
            "sharpen"_a = usual.sharpen, "pipeline_options"_a = std::map<std::string, double>(),
            "dynamic_resolution"_a = false, "placement"_a = usual.placement, "fallback"_a = false, "band_rows"_a = 0,
            "diagnose"_a = false, "alpha"_a = false, "views"_a = std::vector<std::string>(),
            nb::call_guard<nb::gil_scoped_release>())
        .def("upscale", &upscale, nb::sig(upscale_signature), "color"_a.none(), "depth"_a = nb::none(),
             "motion"_a = nb::none(), nb::kw_only(), "jitter"_a = std::pair(0.0f, 0.0f), "reset"_a = false,
             "exposure"_a = 1.0f, "frame_seconds"_a = 1.0f / 60, "near_plane"_a = 0.0f, "far_plane"_a = 0.0f,
             "render_size"_a = nb::none(), "motion_scale"_a = nb::none(), "reactive_mask"_a = nb::none(),
             "transparency_mask"_a = nb::none(), "opaque_color"_a = nb::none(), "ui"_a = nb::none(),
             "exposure_image"_a = nb::none(), "out"_a = nb::none(), upscale_help)
        .def(
            "prepare", [](Stream& stream) { stream.with([](Upscaler& upscaler) { upscaler.prepare(); }); },
            "Compiles, tunes where `tuning` says so, and allocates: what the first frame would do. Raises BuildError, "
            "OutOfMemoryError, DeviceError.")
        .def(
            "reset", [](Stream& stream) { stream.with([](Upscaler& upscaler) { upscaler.reset(); }); },
            "Drops history: the next frame starts anew.")
        .def("close", &Stream::close, "Frees the device's memory now. Further calls raise InvalidArgumentError.")
        .def(
            "__enter__", [](nb::handle self) { return nb::borrow(self); }, nb::sig("def __enter__(self) -> Upscaler"))
        .def(
            "__exit__", [](Stream& stream, nb::handle, nb::handle, nb::handle) { stream.close(); }, "type"_a.none(),
            "value"_a.none(), "traceback"_a.none())
        .def_prop_ro("render_size", [](const Stream& stream) { return pair_of(stream.render_size()); })
        .def_prop_ro("output_size", [](const Stream& stream) { return pair_of(stream.output_size()); })
        .def_prop_ro("needs_depth", &Stream::needs_depth)
        .def_prop_ro("needs_motion", &Stream::needs_motion)
        .def_prop_ro(
            "device_memory",
            [](Stream& stream) {
                return stream.with([](Upscaler& upscaler) { return upscaler.memory_requirements().total(); });
            },
            "In bytes, with the kernels chosen so far.")
        .def_prop_ro(
            "largest_jitter_distance",
            [](Stream& stream) {
                return stream.with([](Upscaler& upscaler) { return upscaler.largest_jitter_distance(); });
            },
            "The most that a frame's jitter was away from the nearest that the model has kernels for, in render "
            "pixels. Beyond 0.01 the model is not used as it was trained.")
        .def_prop_ro(
            "view_names",
            [](Stream& stream) { return stream.with([](Upscaler& upscaler) { return upscaler.view_names(); }); },
            "What `views` may ask for.")
        .def("view", &view, nb::sig("def view(self, name: str) -> numpy.ndarray"), "name"_a,
             "An intermediate of the last frame that `views` has named: rows x columns x channels, float32.")
        .def("__repr__", &Stream::text);
}

}  // namespace clarus::python
