#include "pipelines/pipeline.h"

#include <algorithm>

namespace clarus::pipelines {
namespace {

template <auto build>
graph::Graph at_whole_scale(const io::Safetensors& model, double scale, Size render, const PipelineOptions& options) {
    return build(model, static_cast<int>(scale), render, options);
}

}  // namespace

std::span<const Pipeline> pipelines() {
    static const Pipeline all[] = {
        {"clarus", 1, 4, build_clarus, true, {}, {}, true, {2, 2.02, 3, 3.03, 4}},
        {"enss", 2, 4, at_whole_scale<build_enss>},
        {"mnss", 2, 3, at_whole_scale<build_mnss>},
        {"nsrr", 2, 6, at_whole_scale<build_nsrr>, false, {}, nsrr_options()},
        {"nss", 1, 3, build_nss, true, "autoencoder.temporal_params_out_conv.conv2d.weight"},
        {"srpo", 1, 32, at_whole_scale<build_srpo>, false, {}, {}, false},  // it ends where its last layer has 2048
                                                                            // channels, 2s²
        {"stack", 1, 8, at_whole_scale<build_stack>, false, {}, {}, false},
    };
    return all;
}

bool takes_jitter_out(std::string_view name) {
    return std::ranges::none_of(
        pipelines(), [&](const Pipeline& pipeline) { return pipeline.name == name && !pipeline.takes_jitter_out; });
}

std::span<const double> turning_points(std::string_view name) {
    const auto found = std::ranges::find(pipelines(), name, &Pipeline::name);
    return found == pipelines().end() ? std::span<const double>() : found->turning_points;
}

std::span<const FilterPipeline> filters() {
    static const FilterPipeline all[] = {
        {"nearest", build_nearest}, {"bilinear", build_bilinear},         {"bicubic", build_bicubic},
        {"lanczos", build_lanczos}, {"fsr1", build_fsr1, fsr1_options()}, {"fsr2", build_fsr2, fsr2_options()},
    };
    return all;
}

}  // namespace clarus::pipelines
