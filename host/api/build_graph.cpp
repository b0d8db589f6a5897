#include "api/build_graph.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include "base/error.h"
#include "base/rounding.h"
#include "pipelines/pipeline.h"

namespace clarus {
namespace {

void check_option(const Model& model, const std::string& name, double value) {
    const std::vector<PipelineOption>& all = model.options();
    const auto found =
        std::find_if(all.begin(), all.end(), [&](const PipelineOption& option) { return option.name == name; });
    if (found == all.end()) {
        std::string names;
        for (const PipelineOption& option : all) names += (names.empty() ? "" : ", ") + option.name;
        fail(ErrorKind::invalid_argument, "{} has no option {}; it has: {}", model.name(), name,
             names.empty() ? "none" : names);
    }
    const bool inside = value >= found->smallest && value <= found->largest;
    if (!inside || (found->whole && value != std::floor(value)))
        fail(ErrorKind::invalid_argument, "option {} is {}; of {} it must be {}", name, value, model.name(),
             found->range());
}

pipelines::PipelineOptions option_values(const Model& model, const std::map<std::string, double>& options) {
    for (const auto& [name, value] : options) check_option(model, name, value);
    pipelines::PipelineOptions values = options;
    for (const PipelineOption& option : model.options()) values.try_emplace(option.name, option.usual);
    return values;
}

}  // namespace

Size output_size(Size render, double scale) {
    if (render.width < 1 || render.height < 1 || !(std::max(render.width, render.height) * scale <= kLargestSide))
        fail(ErrorKind::invalid_argument, "render size {}x{} at scale {}: every side must be from 1 to {} pixels",
             render.width, render.height, scale, kLargestSide);
    return scaled(render, scale);
}

Size shown_size(Size own, const std::optional<Size>& asked) {
    if (!asked) return own;
    const auto reaches = [](int from, int to) {
        return to >= 1 && to <= kLargestSide && to <= graph::kMostFitRatio * from && from <= graph::kMostFitRatio * to;
    };
    if (!reaches(own.width, asked->width) || !reaches(own.height, asked->height))
        fail(
            ErrorKind::invalid_argument,
            "output size {}x{}: the model makes {}x{}, which can be resampled to sides from 1 to {} pixels, at most {} "
            "times as large or as small",
            asked->width, asked->height, own.width, own.height, kLargestSide, graph::kMostFitRatio);
    return *asked;
}

std::optional<double> common_scale(Size render, Size output) {
    const double wide = static_cast<double>(output.width) / render.width,
                 high = static_cast<double>(output.height) / render.height;
    // That of the longer side, which rounding changes less. Both sides may be off by half a render pixel.
    const double scale = render.width > render.height ? wide : high;
    const double off =
        std::max(std::abs(scale * render.width - output.width), std::abs(scale * render.height - output.height));
    if (off > scale) return std::nullopt;
    return scale;
}

ModelSizes model_sizes(const Model& model, Size render, const std::optional<Size>& asked) {
    const ModelSizes usual{model.scale(), output_size(render, model.scale())};
    if (!asked || model.scales().is_single()) return usual;
    const std::optional<double> scale = common_scale(render, *asked);
    if (!scale) return usual;
    const double nearest = std::clamp(*scale, model.scales().smallest, model.scales().largest);
    return {nearest, model.tensors() || nearest != *scale ? output_size(render, nearest) : *asked};
}

graph::Graph build_graph(const Model& model, Size render, Size output,
                         const std::map<std::string, double>& pipeline_options, std::optional<double> scale) {
    const double used = scale.value_or(model.scale());
    const pipelines::PipelineOptions values = option_values(model, pipeline_options);
    for (const pipelines::FilterPipeline& filter : pipelines::filters())
        if (filter.name == model.pipeline()) return filter.build({used, render, output, values});
    for (const pipelines::Pipeline& pipeline : pipelines::pipelines())
        if (pipeline.name == model.pipeline()) return pipeline.build(*model.tensors(), used, render, values);
    throw std::logic_error("a model was loaded for a pipeline that is not there");
}

}  // namespace clarus
