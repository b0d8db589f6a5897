#pragma once

#include "clarus/model.h"

namespace clarus::pipelines {

/// By how much a pipeline that ends with RCAS sharpens.
inline PipelineOption sharpness_option(double usual) {
    return {"sharpness", "how much FSR 1's filter sharpens the picture (0: not at all)", 0, 1, usual};
}

}  // namespace clarus::pipelines
