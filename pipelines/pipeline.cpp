#include "pipelines/pipeline.h"

namespace clarus::pipelines {

std::span<const Pipeline> pipelines() {
    static const Pipeline all[] = {
        {"enss", 2, 4, true, build_enss},
        {"mnss", 2, 3, true, build_mnss},
        {"srpo", 1, 8, false, build_srpo},
        {"nsrr", 2, 6, true, build_nsrr},
    };
    return all;
}

std::span<const FilterPipeline> filters() {
    static const FilterPipeline all[] = {
        {"nearest", build_nearest},
        {"bilinear", build_bilinear},
        {"bicubic", build_bicubic},
        {"lanczos", build_lanczos},
    };
    return all;
}

}  // namespace clarus::pipelines
