#pragma once

#include "cl/context.h"
#include "clarus/types.h"
#include "io/image.h"

namespace clarus {

/// The first `channels` of an image in host memory as numbers: integers over their largest, floats as they are
/// (clarus/format.h).
io::Pixels host_values(const Image& image, const ImageFormat& format, int channels);

/// The same of any image of a caller. Buffers and image objects are read by the context's queue. Waits. Errors: device.
io::Pixels stored_values(const Image& image, const ImageFormat& format, int channels, const ocl::Context& context);

}  // namespace clarus
