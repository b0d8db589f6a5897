#include "api/build_graph.h"

#include <algorithm>
#include <stdexcept>

#include "base/error.h"
#include "base/rounding.h"
#include "pipelines/pipeline.h"

namespace clarus {
namespace {

// More is a mistake rather than an image.
constexpr int kLargestSide = 1 << 15;

// 2^-0.2: AMD's own is 0.2 stops below the most. FSR 2 leaves sharpening to be asked for.
constexpr float kUsualSharpness = 0.87f;

float sharpness(const Model& model, const UpscalerOptions& options) {
    if (!options.sharpness) return model.pipeline() == "fsr1" ? kUsualSharpness : 0;
    if (model.pipeline() != "fsr1" && model.pipeline() != "fsr2")
        fail(ErrorKind::invalid_argument, "options.sharpness: {} is not sharpened; only fsr1 and fsr2 are",
             model.name());
    if (!(*options.sharpness >= 0 && *options.sharpness <= 1))
        fail(ErrorKind::invalid_argument, "options.sharpness: {}; must be from 0 to 1", *options.sharpness);
    return *options.sharpness;
}

}  // namespace

Size output_size(Size render, double scale) {
    if (render.width < 1 || render.height < 1 || !(std::max(render.width, render.height) * scale <= kLargestSide))
        fail(ErrorKind::invalid_argument, "render size {}x{} at scale {}: every side must be from 1 to {} pixels",
             render.width, render.height, scale, kLargestSide);
    return scaled(render, scale);
}

graph::Graph build_graph(const Model& model, Size render, Size output, const UpscalerOptions& options) {
    if (options.previous_frames && model.pipeline() != "nsrr")
        fail(ErrorKind::invalid_argument,
             "options.previous_frames: {} is of pipeline {}; only an nsrr model lets choose how many frames it uses",
             model.name(), model.pipeline());
    const pipelines::FilterSettings settings{model.scale(), render, output, sharpness(model, options)};
    for (const pipelines::FilterPipeline& filter : pipelines::filters())
        if (filter.name == model.pipeline()) return filter.build(settings);
    for (const pipelines::Pipeline& pipeline : pipelines::pipelines())
        if (pipeline.name == model.pipeline())
            return pipeline.build(*model.tensors(), model.scale(), render, {options.previous_frames});
    throw std::logic_error("a model was loaded for a pipeline that is not there");
}

}  // namespace clarus
