#include <algorithm>
#include <iterator>
#include <string>
#include <string_view>
#include <vector>

#include "base/error.h"
#include "base/nearest.h"
#include "pipelines/pipeline.h"

namespace clarus::pipelines {
namespace {

/// docs/formats.md, "A model". Files may have others, for people.
constexpr std::string_view kKnownMetadata[] = {"pipeline", "scale", "features", "previous_frames", "network_color",
                                               "history",  "range", "white",    "layers",          "quantization"};

}  // namespace

void refuse_misspelt_metadata(const io::Safetensors& model) {
    for (const auto& [key, value] : model.metadata()) {
        if (std::ranges::find(kKnownMetadata, key) != std::end(kKnownMetadata)) continue;
        const std::string_view meant = nearest(key, kKnownMetadata);
        if (!meant.empty() && !model.metadata().contains(std::string(meant)))
            fail(ErrorKind::file, "{}: the metadata have an unknown key `{}`; is it `{}`?", model.path().string(), key,
                 meant);
    }
}

const Pipeline& pipeline_of(const io::Safetensors& model) {
    const std::span<const Pipeline> all = pipelines();
    if (!model.metadata().contains("pipeline"))
        for (const Pipeline& known : all)
            if (!known.mark.empty() && model.has(std::string(known.mark))) return known;
    const std::string& name = model.require_metadata("pipeline");
    const auto found = std::ranges::find(all, name, &Pipeline::name);
    if (found != all.end()) return *found;
    std::string names;
    for (const Pipeline& known : all) names += (names.empty() ? "" : ", ") + std::string(known.name);
    fail(ErrorKind::file, "{}: metadata `pipeline` is \"{}\"; known: {}", model.path().string(), name, names);
}

ScaleRange scales_of(const io::Safetensors& model, const Pipeline& pipeline) {
    if (!pipeline.any_scale) {
        const int scale = model.require_integer("scale", static_cast<int>(pipeline.smallest_scale),
                                                static_cast<int>(pipeline.largest_scale));
        return {static_cast<double>(scale), static_cast<double>(scale)};
    }
    const bool is_published_without = !pipeline.mark.empty() && !model.metadata().contains("scale");
    if (is_published_without || model.require_metadata("scale") == "any")
        return {pipeline.smallest_scale, pipeline.largest_scale};
    const double scale = model.require_number("scale", pipeline.smallest_scale, pipeline.largest_scale);
    return {scale, scale};
}

std::vector<PipelineOption> options_of(const io::Safetensors& model, const Pipeline& pipeline) {
    std::vector<PipelineOption> options = pipeline.options;
    for (PipelineOption& option : options)
        if (option.limited_by_model)
            option.largest = option.usual =
                model.require_integer(option.name, static_cast<int>(option.smallest), static_cast<int>(option.largest));
    return options;
}

}  // namespace clarus::pipelines
