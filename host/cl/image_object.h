#pragma once

#include <array>
#include <cstddef>

#include "cl/opencl.h"
#include "clarus/types.h"

namespace clarus::ocl {

/// The caller's image object, and what of it the image is, as OpenCL's calls take it.
struct ImageObject {
    cl::Image2D object;
    std::array<size_t, 3> origin, region;

    explicit ImageObject(const Image& image)
        : object(image.image, true),
          origin{static_cast<size_t>(image.origin.x), static_cast<size_t>(image.origin.y), 0},
          region{static_cast<size_t>(image.size.width), static_cast<size_t>(image.size.height), 1} {}
};

}  // namespace clarus::ocl
