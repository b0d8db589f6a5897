#pragma once

#include <cstddef>
#include <stdexcept>
#include <string_view>

#include "clarus/types.h"

namespace clarus {

/// Of a component, or of a pixel where it is packed: what images are aligned to.
constexpr size_t bytes_of(ElementType type) {
    switch (type) {
        case ElementType::u8:
            return 1;
        case ElementType::f16:
        case ElementType::u16:
            return 2;
        default:
            return 4;
    }
}

/// Its name in C++, in options of kernels (kernels/ingest.cl) and in messages.
constexpr std::string_view element_name(ElementType type) {
    switch (type) {
        case ElementType::u8:
            return "u8";
        case ElementType::f16:
            return "f16";
        case ElementType::f32:
            return "f32";
        case ElementType::u16:
            return "u16";
        case ElementType::rgb10a2:
            return "rgb10a2";
        case ElementType::r11g11b10f:
            return "r11g11b10f";
        case ElementType::d24:
            return "d24";
    }
    throw std::logic_error("unknown element type");
}

/// Channels that a packed type has; 0 of one that stores components by themselves.
constexpr int packed_channels(ElementType type) {
    switch (type) {
        case ElementType::rgb10a2:
            return 4;
        case ElementType::r11g11b10f:
            return 3;
        case ElementType::d24:
            return 1;
        default:
            return 0;
    }
}

constexpr size_t pixel_bytes(const ImageFormat& format) {
    return bytes_of(format.type) * (packed_channels(format.type) ? 1 : format.channels);
}

/// Bytes of a row, or of all rows, without gaps.
constexpr size_t tight_pitch(Size size, const ImageFormat& format) { return pixel_bytes(format) * size.width; }
constexpr size_t tight_bytes(Size size, const ImageFormat& format) { return tight_pitch(size, format) * size.height; }

/// Bytes from row to row of an image of this format, or of the larger one that it is a part of.
constexpr size_t row_pitch(const Image& image, const ImageFormat& format) {
    return image.row_pitch ? image.row_pitch : tight_pitch(image.size, format);
}

/// Bytes from where the larger image begins, in its buffer or host memory, to the first pixel.
constexpr size_t first_byte(const Image& image, const ImageFormat& format) {
    return image.offset + image.origin.y * row_pitch(image, format) + image.origin.x * pixel_bytes(format);
}

}  // namespace clarus
