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

/// Bytes from row to row of an image of this format, or of the larger one that it is a part of.
constexpr size_t row_pitch(const Image& image, const ImageFormat& format) {
    return image.row_pitch ? image.row_pitch : tight_pitch(image.size, format);
}

/// Bytes from where the larger image begins, in its buffer or host memory, to the first pixel.
constexpr size_t first_byte(const Image& image, const ImageFormat& format) {
    return image.offset + image.origin.y * row_pitch(image, format) +
           image.origin.x * bytes_of(format.type) * format.channels;
}

}  // namespace clarus
