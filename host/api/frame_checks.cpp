#include "api/frame_checks.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string_view>

#include "api/build_graph.h"
#include "api/memory_checks.h"
#include "base/error.h"
#include "base/image_format.h"

namespace clarus {
namespace {

void check_format(std::string_view name, const ImageFormat& format, int least, int most) {
    if (format.type < ElementType::u8 || format.type > ElementType::d24)
        fail(ErrorKind::invalid_argument, "options.{}: there is no element type {}", name,
             static_cast<int>(format.type));
    if (format.channels < least || format.channels > most)
        fail(ErrorKind::invalid_argument, "options.{}: {} channels; from {} to {} are possible", name, format.channels,
             least, most);
    const int packed = packed_channels(format.type);
    if (packed && format.channels != packed)
        fail(ErrorKind::invalid_argument, "options.{}: {} channels; a pixel that is packed so has {}", name,
             format.channels, packed);
}

void check_motion_scale(std::string_view name, Vec2 scale) {
    if (!std::isfinite(scale.x) || !std::isfinite(scale.y))
        fail(ErrorKind::invalid_argument, "{}: ({}, {}); must be finite", name, scale.x, scale.y);
}

void check_size(std::string_view name, Size size) {
    if (size.width < 1 || size.height < 1 || size.width > kLargestSide || size.height > kLargestSide)
        fail(ErrorKind::invalid_argument, "{}: {}x{}; each side is from 1 to {}", name, size.width, size.height,
             kLargestSide);
}

template <typename Enum>
void check_word(std::string_view name, Enum value, Enum last) {
    if (value < Enum{} || value > last)
        fail(ErrorKind::invalid_argument, "options.{}: there is no {}", name, static_cast<int>(value));
}

bool is_real(ElementType type) { return type == ElementType::f16 || type == ElementType::f32; }

void check_image(std::string_view name, const Image& image, const ImageFormat& format, Size size, cl_context context,
                 Use use = Use::input) {
    if (image.empty())
        fail(ErrorKind::invalid_argument, "frame.{}: neither host memory nor a buffer nor an image object", name);
    if (!!image.host + !!image.buffer + !!image.image != 1)
        fail(ErrorKind::invalid_argument, "frame.{}: two of host memory, a buffer and an image object; give one", name);
    if (image.size != size)
        fail(ErrorKind::invalid_argument, "frame.{}: {}x{} pixels, expected {}x{}", name, image.size.width,
             image.size.height, size.width, size.height);
    if (image.origin.x < 0 || image.origin.y < 0)
        fail(ErrorKind::invalid_argument, "frame.{}: origin ({}, {}); neither may be negative", name, image.origin.x,
             image.origin.y);
    if (image.image) {
        check_image_object(name, image, format, context);
        return;
    }
    const size_t element = bytes_of(format.type);
    const size_t tight = tight_pitch(size, format);
    if (image.origin != Position{} && image.row_pitch == 0)
        fail(ErrorKind::invalid_argument, "frame.{}: an origin wants the row_pitch of the image that it is in", name);
    const size_t before = static_cast<size_t>(image.origin.x) * pixel_bytes(format);
    if (image.row_pitch != 0 && image.row_pitch < before + tight)
        fail(ErrorKind::invalid_argument, "frame.{}: row_pitch {} is less than a row's {} bytes", name, image.row_pitch,
             before + tight);
    if (image.row_pitch % element != 0 || image.offset % element != 0)
        fail(ErrorKind::invalid_argument, "frame.{}: row_pitch and offset must be multiples of {} bytes", name,
             element);
    if (image.row_pitch > std::numeric_limits<cl_uint>::max())
        fail(ErrorKind::invalid_argument, "frame.{}: row_pitch {} is beyond 4 GiB", name, image.row_pitch);
    if (image.host && image.offset != 0)
        fail(ErrorKind::invalid_argument, "frame.{}: offset is for buffers; let `host` point to the first pixel", name);
    if (image.buffer) check_buffer(name, image, format, context, use);
}

void check_optional(std::string_view name, const Image& image, std::string_view option,
                    const std::optional<ImageFormat>& format, Size size, cl_context context) {
    if (image.empty()) return;
    if (!format)
        fail(ErrorKind::invalid_argument, "frame.{}: options.{} is not set, so that it would not be read", name,
             option);
    check_image(name, image, *format, size, context);
}

}  // namespace

void check_options(const runtime::PlanOptions& options, const graph::Graph& graph) {
    constexpr int kMostChannels = 16;
    check_word("precision", options.precision, Precision::bf16);
    check_word("tuning", options.tuning, Tuning::obvious);
    check_word("color_space", options.color_space, ColorSpace::linear);
    check_motion_scale("options.motion.scale", options.motion.scale);
    check_format("color_format", options.color_format, 3, kMostChannels);
    check_format("depth_format", options.depth_format, 1, kMostChannels);
    check_format("motion_format", options.motion_format, 2, kMostChannels);
    if (options.reactive_format) check_format("reactive_format", *options.reactive_format, 1, kMostChannels);
    if (options.transparency_format)
        check_format("transparency_format", *options.transparency_format, 1, kMostChannels);
    if (options.opaque_format) check_format("opaque_format", *options.opaque_format, 3, kMostChannels);
    if (options.ui_format) check_format("ui_format", *options.ui_format, 4, 4);
    if (options.ui_format && options.color_space == ColorSpace::linear)
        fail(ErrorKind::invalid_argument,
             "options.ui_format: user interface is drawn over display-encoded output; over linear output it comes "
             "after the display's tone curve");
    if (options.exposure_format) check_format("exposure_format", *options.exposure_format, 1, kMostChannels);
    if (options.exposure_format && options.automatic_exposure)
        fail(ErrorKind::invalid_argument, "options.automatic_exposure: not with options.exposure_format; take one");
    for (const auto& [name, is_set] : {std::pair("exposure_format", options.exposure_format.has_value()),
                                       std::pair("automatic_exposure", options.automatic_exposure)})
        if (is_set && options.color_space != ColorSpace::linear)
            fail(ErrorKind::invalid_argument, "options.{}: display-encoded colour has no exposure", name);
    if (options.motion_size) check_size("options.motion_size", *options.motion_size);
    check_format("output_format", options.output_format, 3, 4);
    if (!is_real(options.motion_format.type))
        fail(ErrorKind::invalid_argument, "options.motion_format: motion vectors are f16 or f32");
    if (!is_real(options.output_format.type) && options.output_format.type != ElementType::u8)
        fail(ErrorKind::invalid_argument, "options.output_format: output is u8, f16 or f32");
    if (options.output_format.type == ElementType::u8 && options.color_space == ColorSpace::linear)
        fail(ErrorKind::invalid_argument, "options.output_format: linear HDR output is f16 or f32");
    if (options.band_rows < 0)
        fail(ErrorKind::invalid_argument, "options.band_rows: {}; 0 chooses, else it is 1 or more", options.band_rows);
    for (const std::string& view : options.views) {
        if (graph.views.contains(view)) continue;
        std::string names;
        for (const auto& [name, value] : graph.views) names += (names.empty() ? "" : ", ") + name;
        fail(ErrorKind::invalid_argument, "no view is named \"{}\"; there are: {}", view,
             names.empty() ? "none" : names);
    }
}

void check_frame(const FrameDescription& frame, const StreamOptions& options, const FrameSizes& sizes, Needs needs,
                 cl_context context) {
    check_image("color", frame.color, options.color_format, sizes.color, context);
    if (needs.depth) check_image("depth", frame.depth, options.depth_format, sizes.render, context);
    if (needs.motion)
        check_image("motion", frame.motion, options.motion_format, options.motion_size.value_or(sizes.render), context);
    check_image("output", frame.output, options.output_format, sizes.output, context, Use::output);
    if (!(std::abs(frame.jitter.x) <= 1 && std::abs(frame.jitter.y) <= 1))
        fail(ErrorKind::invalid_argument, "frame.jitter: ({}, {}); each must be from -1 to 1 render pixel",
             frame.jitter.x, frame.jitter.y);
    if (!(frame.exposure >= std::numeric_limits<float>::min()) || !std::isfinite(frame.exposure))
        fail(ErrorKind::invalid_argument, "frame.exposure: {}; must be greater than 0 and a normal number",
             frame.exposure);
    if (!(frame.frame_seconds >= 0) || !std::isfinite(frame.frame_seconds))
        fail(ErrorKind::invalid_argument, "frame.frame_seconds: {}; must be 0 or more", frame.frame_seconds);
    if (frame.motion_scale) check_motion_scale("frame.motion_scale", *frame.motion_scale);
    if (needs.depth && options.depth.projective && !(frame.near_plane > 0 && frame.far_plane > frame.near_plane))
        fail(ErrorKind::invalid_argument, "frame.near_plane {}, far_plane {}: must be 0 < near < far", frame.near_plane,
             frame.far_plane);
    if (options.exposure_format && frame.exposure_image.empty())
        fail(ErrorKind::invalid_argument, "frame.exposure_image: none, though options.exposure_format is set");
    check_optional("exposure_image", frame.exposure_image, "exposure_format", options.exposure_format, {1, 1}, context);
    check_optional("reactive_mask", frame.reactive_mask, "reactive_format", options.reactive_format, sizes.render,
                   context);
    check_optional("transparency_mask", frame.transparency_mask, "transparency_format", options.transparency_format,
                   sizes.render, context);
    if (needs.opaque_color && frame.opaque_color.empty())
        fail(ErrorKind::invalid_argument, "frame.opaque_color: none, though options.opaque_format is set");
    check_optional("opaque_color", frame.opaque_color, "opaque_format", options.opaque_format, sizes.render, context);
    check_optional("ui", frame.ui, "ui_format", options.ui_format, sizes.output, context);
}

int sample_position(double jitter, int scale) {
    // 0.001 keeps a jitter that lies on a sub-pixel's edge from depending on rounding.
    return std::clamp(static_cast<int>(std::floor(scale * (0.5 + jitter) + 0.001)), 0, scale - 1);
}

}  // namespace clarus
