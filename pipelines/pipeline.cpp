#include "pipelines/pipeline.h"

namespace clarus::pipelines {

std::span<const Pipeline> pipelines() {
    static const Pipeline all[] = {
        {"enss", 2, 4, true, build_enss},    {"mnss", 2, 3, true, build_mnss}, {"srpo", 1, 8, false, build_srpo},
        {"stack", 1, 8, false, build_stack}, {"nsrr", 2, 6, true, build_nsrr},
    };
    return all;
}

std::span<const FilterPipeline> filters() {
    static const FilterPipeline all[] = {
        {"nearest", false, build_nearest}, {"bilinear", false, build_bilinear}, {"bicubic", false, build_bicubic},
        {"lanczos", false, build_lanczos}, {"fsr1", false, build_fsr1},         {"taau", true, build_taau},
    };
    return all;
}

}  // namespace clarus::pipelines
