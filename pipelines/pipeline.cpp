#include "pipelines/pipeline.h"

namespace clarus::pipelines {
namespace {

template <graph::Graph (*build)(const io::Safetensors&, int, Size, const PipelineOptions&)>
graph::Graph at_whole_scale(const io::Safetensors& model, double scale, Size render, const PipelineOptions& options) {
    return build(model, static_cast<int>(scale), render, options);
}

}  // namespace

std::span<const Pipeline> pipelines() {
    static const Pipeline all[] = {
        // SRPO ends where its last layer has 2048 channels, 2s².
        {"enss", 2, 4, at_whole_scale<build_enss>},
        {"mnss", 2, 3, at_whole_scale<build_mnss>},
        {"srpo", 1, 32, at_whole_scale<build_srpo>},
        {"stack", 1, 8, at_whole_scale<build_stack>},
        {"nsrr", 2, 6, at_whole_scale<build_nsrr>},
        {"nss", 1, 3, build_nss, true, "autoencoder.temporal_params_out_conv.conv2d.weight"},
    };
    return all;
}

std::span<const FilterPipeline> filters() {
    static const FilterPipeline all[] = {
        {"nearest", build_nearest}, {"bilinear", build_bilinear}, {"bicubic", build_bicubic},
        {"lanczos", build_lanczos}, {"fsr1", build_fsr1},         {"taau", build_taau},
    };
    return all;
}

}  // namespace clarus::pipelines
