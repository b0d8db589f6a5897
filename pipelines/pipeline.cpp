#include "pipelines/pipeline.h"

namespace clarus::pipelines {

std::span<const Pipeline> pipelines() {
    static const Pipeline all[] = {
        // SRPO ends where its last layer has 2048 channels, 2s².
        {"enss", 2, 4, build_enss},   {"mnss", 2, 3, build_mnss}, {"srpo", 1, 32, build_srpo},
        {"stack", 1, 8, build_stack}, {"nsrr", 2, 6, build_nsrr},
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
