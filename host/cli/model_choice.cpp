#include "cli/model_choice.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <utility>

#include "base/error.h"
#include "base/parse.h"
#include "base/rounding.h"

namespace clarus::cli {
namespace {

/// For a model of any scale: one that makes output of this size, or else the nearest larger one along both axes.
double scale_to(Size output, const io::Sequence& sequence, const Model& model) {
    const Size render = sequence.render_size;
    const double across = static_cast<double>(output.width) / render.width;
    const double down = static_cast<double>(output.height) / render.height;
    const ScaleRange scales = model.scales();
    for (const double scale : {sequence.scale, across, down})
        if (scaled(render, scale) == output && scales.contains(scale)) return scale;
    return std::clamp(std::max(across, down), scales.smallest, scales.largest);
}

}  // namespace

Model find_model(const ModelWish& wish) {
    Model model = Model::find(wish.model, wish.scale.value_or(2));
    if (model.scales().is_single() && wish.scale && *wish.scale != model.scale())
        fail(ErrorKind::invalid_argument,
             "model {} upscales by {}, not by --scale {}; `clarus models` lists what takes any scale, and "
             "--output-size WxH resamples what it makes",
             model.name(), model.scale(), *wish.scale);
    return model;
}

ChosenModel choose_model(Model model, const ModelWish& wish, const io::Sequence& sequence, bool dynamic,
                         const std::string& source) {
    std::optional<Size> output_size = wish.output_size;
    if (!output_size && !wish.scale) output_size = sequence.shown_size;
    if (!model.scales().is_single()) {
        const double usual = output_size ? scale_to(*output_size, sequence, model) : sequence.scale;
        model = Model::find(wish.model, wish.scale.value_or(usual));
    } else if (!output_size && model.scale() != sequence.scale) {
        fail(ErrorKind::invalid_argument,
             "model {} upscales by {}, but {} is made for {}; `clarus models` lists the models there are, and "
             "--output-size WxH resamples what one makes",
             model.name(), model.scale(), source, sequence.scale);
    }
    if (!output_size && dynamic) output_size = scaled(sequence.render_size, model.scale());
    return {std::move(model), output_size};
}

UpscalerOptions options_for(UpscalerOptions settings, const io::Sequence& sequence, bool dynamic,
                            const std::optional<Size>& output_size) {
    settings.output_size = output_size;
    settings.color_space = sequence.color_space;
    settings.depth = sequence.depth;
    settings.motion = sequence.motion_encoding();
    settings.dynamic_resolution = dynamic;
    const ImageFormat mask{ElementType::f32, 1};  // as io/frames reads it
    if (sequence.any_has("reactive")) settings.reactive_format = mask;
    if (sequence.any_has("transparency")) settings.transparency_format = mask;
    if (sequence.any_has("opaque_color")) settings.opaque_format = ImageFormat{ElementType::f32, 3};
    if (sequence.any_has("ui")) settings.ui_format = ImageFormat{ElementType::f32, 4};
    return settings;
}

Size parse_output_size(const std::string& text) {
    const std::optional<Size> size = parse_size(text);
    if (!size)
        throw CLI::ValidationError("--output-size", text + " is not WIDTHxHEIGHT with both from 1, such as 2560x1440");
    return *size;
}

}  // namespace clarus::cli
