#include "pipelines/pipeline.h"

namespace clarus::pipelines {

std::span<const Pipeline> pipelines() {
    static const Pipeline all[] = {
        {"enss", 2, 4, true, build_enss},
        {"nsrr", 2, 6, true, build_nsrr},
    };
    return all;
}

std::span<const FilterPipeline> filters() {
    static const FilterPipeline all[] = {
        {"bilinear", build_bilinear},
        {"bicubic", build_bicubic},
    };
    return all;
}

}  // namespace clarus::pipelines
