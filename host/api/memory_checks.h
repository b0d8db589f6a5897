#pragma once

#include <string_view>

#include "cl/opencl.h"
#include "clarus/types.h"

namespace clarus {

/// Which way a frame's image goes.
enum class Use { input, output };

/// That frame.`name` has a buffer of `context`, large enough, which kernels may read or write. No context: the devices
/// share none. Errors: invalid_argument, naming the field.
void check_buffer(std::string_view name, const Image& image, const ImageFormat& format, cl_context context, Use use);

/// Likewise that it has a 2D image object of the format. It is copied, by no kernel: which of these may read or write
/// it is of no concern.
void check_image_object(std::string_view name, const Image& image, const ImageFormat& format, cl_context context);

}  // namespace clarus
