#include "api/c/descriptions.h"

#include <algorithm>
#include <cstddef>
#include <cstring>

#include "api/c/guard.h"
#include "api/c/structs.h"

namespace clarus::c {
namespace {

/// What a program gives as an enumeration of C's may be any number. Read as that enumeration it would be undefined.
template <typename To, typename From>
To read_as(const From& from) {
    static_assert(sizeof(To) == sizeof(From));
    To to;
    std::memcpy(&to, &from, sizeof to);
    return to;
}

ImageFormat format(const clarus_format& from) { return {read_as<ElementType>(from.type), from.channels}; }
clarus_format format(ImageFormat from) { return {static_cast<clarus_element_type>(from.type), from.channels}; }

Image image(const clarus_image& from) {
    return {from.host,
            from.buffer,
            from.image,
            from.offset,
            from.row_pitch,
            {from.width, from.height},
            {from.origin_x, from.origin_y}};
}

}  // namespace

UpscalerOptions options_from(const clarus_options* given_options) {
    const clarus_options from = known(given_options, clarus_default_options(), "options");
    UpscalerOptions options;
    options.precision = read_as<Precision>(from.precision);
    options.tuning = read_as<Tuning>(from.tuning);
    options.color_space = from.linear_color ? ColorSpace::linear : ColorSpace::srgb;
    options.depth = {from.depth_projective != 0, from.depth_reversed != 0};
    options.motion = {
        {from.motion_scale_x, from.motion_scale_y}, from.motion_jittered != 0, from.motion_sampled_at_jitter != 0};
    options.color_format = format(from.color_format);
    options.depth_format = format(from.depth_format);
    options.motion_format = format(from.motion_format);
    options.output_format = format(from.output_format);
    if (from.reactive_format.channels != 0) options.reactive_format = format(from.reactive_format);
    if (from.transparency_format.channels != 0) options.transparency_format = format(from.transparency_format);
    if (from.opaque_format.channels != 0) options.opaque_format = format(from.opaque_format);
    if (from.ui_format.channels != 0) options.ui_format = format(from.ui_format);
    if (from.motion_width != 0 || from.motion_height != 0)
        options.motion_size = Size{from.motion_width, from.motion_height};
    if (from.exposure_format.channels != 0) options.exposure_format = format(from.exposure_format);
    options.automatic_exposure = from.automatic_exposure != 0;
    options.antialias_input = static_cast<Antialiasing>(from.antialias_input != 0);
    options.antialias = static_cast<Antialiasing>(from.antialias != 0);
    options.sharpen = from.sharpen;
    options.dynamic_resolution = from.dynamic_resolution != 0;
    if (from.placement) options.placement = from.placement;
    options.fallback = from.fallback != 0;
    options.diagnose = from.diagnose != 0;
    options.alpha = from.alpha != 0;
    options.profile = from.profile != 0;
    options.band_rows = from.band_rows;
    if (from.view_count > 0) given(from.views, "options.views");
    for (size_t i = 0; i < from.view_count; ++i) options.views.emplace_back(&given(from.views[i], "one of the views"));
    if (from.output_width != 0 || from.output_height != 0)
        options.output_size = Size{from.output_width, from.output_height};
    if (from.pipeline_option_count > 0) given(from.pipeline_options, "options.pipeline_options");
    for (size_t i = 0; i < from.pipeline_option_count; ++i) {
        const clarus_pipeline_option& option = from.pipeline_options[i];
        if (!option.name) fail(ErrorKind::invalid_argument, "options.pipeline_options[{}] has no name", i);
        options.pipeline_options[option.name] = option.value;
    }
    return options;
}

FrameDescription frame_from(const clarus_frame& given_frame) {
    const clarus_frame from = known(&given_frame, clarus_default_frame(), "frame");
    FrameDescription frame;
    frame.render_size = {from.render_width, from.render_height};
    if (from.motion_scale_x != 0 || from.motion_scale_y != 0)
        frame.motion_scale = Vec2{from.motion_scale_x, from.motion_scale_y};
    frame.color = image(from.color);
    frame.depth = image(from.depth);
    frame.motion = image(from.motion);
    frame.jitter = {from.jitter_x, from.jitter_y};
    frame.exposure = from.exposure;
    frame.frame_seconds = from.frame_seconds;
    frame.near_plane = from.near_plane;
    frame.far_plane = from.far_plane;
    frame.reset = from.reset != 0;
    frame.output = image(from.output);
    if (from.wait_for_count > 0) given(from.wait_for, "frame.wait_for");
    for (size_t i = 0; i < from.wait_for_count; ++i)
        if (!from.wait_for[i]) fail(ErrorKind::invalid_argument, "frame.wait_for[{}] is NULL", i);
    frame.reactive_mask = image(from.reactive_mask);
    frame.transparency_mask = image(from.transparency_mask);
    frame.opaque_color = image(from.opaque_color);
    frame.ui = image(from.ui);
    frame.exposure_image = image(from.exposure_image);
    if (from.camera) {
        FrameParameters::Camera& camera = frame.camera.emplace();
        std::copy_n(from.camera->view, camera.view.size(), camera.view.begin());
        std::copy_n(from.camera->projection, camera.projection.size(), camera.projection.begin());
        camera.near_plane = from.camera->near_plane;
        camera.far_plane = from.camera->far_plane;
        camera.fov_y = from.camera->fov_y;
    }
    frame.wait_for = {from.wait_for, from.wait_for_count};
    return frame;
}

}  // namespace clarus::c

using namespace clarus::c;

extern "C" {

void clarus_options_init(clarus_options* options, size_t struct_size) {
    const clarus::UpscalerOptions from;
    clarus_options usual{};
    usual.motion_scale_x = from.motion.scale.x;
    usual.motion_scale_y = from.motion.scale.y;
    usual.color_format = format(from.color_format);
    usual.depth_format = format(from.depth_format);
    usual.motion_format = format(from.motion_format);
    usual.output_format = format(from.output_format);
    set_usual(options, usual, struct_size);
}

void clarus_frame_init(clarus_frame* frame, size_t struct_size) {
    clarus_frame usual{};
    const clarus::FrameParameters from;
    usual.exposure = from.exposure;
    usual.frame_seconds = from.frame_seconds;
    set_usual(frame, usual, struct_size);
}

}  // extern "C"
