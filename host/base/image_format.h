#pragma once

#include <cstddef>

#include "clarus/types.h"

namespace clarus {

constexpr size_t bytes_of(ElementType type) { return type == ElementType::u8 ? 1 : type == ElementType::f16 ? 2 : 4; }

/// Bytes of a row, or of all rows, without gaps.
constexpr size_t tight_pitch(Size size, const ImageFormat& format) {
    return bytes_of(format.type) * format.channels * size.width;
}
constexpr size_t tight_bytes(Size size, const ImageFormat& format) { return tight_pitch(size, format) * size.height; }

/// Bytes from row to row of an image of this format.
constexpr size_t row_pitch(const Image& image, const ImageFormat& format) {
    return image.row_pitch ? image.row_pitch : tight_pitch(image.size, format);
}

}  // namespace clarus
