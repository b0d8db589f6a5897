#include "api/stored_values.h"

#include <Imath/half.h>

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <vector>

#include "base/image_format.h"
#include "cl/error.h"
#include "cl/image_object.h"

namespace clarus {
namespace {

template <typename T>
T loaded(const std::byte* from, int index) {
    T value;
    std::memcpy(&value, from + sizeof(T) * index, sizeof value);
    return value;
}

float half_value(uint32_t bits) { return Imath::half(Imath::half::FromBits, static_cast<uint16_t>(bits)); }

/// Component c of the pixel at `from`; kernels/ingest.cl reads the same.
float component(const std::byte* from, ElementType type, int c) {
    switch (type) {
        case ElementType::u8:
            return static_cast<float>(loaded<uint8_t>(from, c)) / 255;
        case ElementType::u16:
            return static_cast<float>(loaded<uint16_t>(from, c)) / 65535;
        case ElementType::f16:
            return half_value(loaded<uint16_t>(from, c));
        case ElementType::f32:
            return loaded<float>(from, c);
        case ElementType::rgb10a2: {
            const uint32_t largest = c == 3 ? 3 : 1023;
            return static_cast<float>(loaded<uint32_t>(from, 0) >> (10 * c) & largest) / static_cast<float>(largest);
        }
        case ElementType::r11g11b10f: {  // a half's exponent, no sign, 6, 6 and 5 bits of its mantissa
            const uint32_t pixel = loaded<uint32_t>(from, 0);
            return half_value(c == 0 ? pixel << 4 & 0x7ff0 : c == 1 ? pixel >> 7 & 0x7ff0 : pixel >> 17 & 0x7fe0);
        }
        case ElementType::d24:
            return static_cast<float>(loaded<uint32_t>(from, 0) & 0xffffff) / 16777215;
    }
    throw std::logic_error("unknown element type");
}

}  // namespace

io::Pixels host_values(const Image& image, const ImageFormat& format, int channels) {
    const size_t pitch = row_pitch(image, format);
    const std::byte* pixels = static_cast<const std::byte*>(image.host) + first_byte(image, format);
    io::Pixels values{image.size, channels, {}};
    values.values.reserve(static_cast<size_t>(image.size.width) * image.size.height * channels);
    for (int y = 0; y < image.size.height; ++y)
        for (int x = 0; x < image.size.width; ++x)
            for (int c = 0; c < channels; ++c)
                values.values.push_back(component(pixels + y * pitch + x * pixel_bytes(format), format.type, c));
    return values;
}

io::Pixels stored_values(const Image& image, const ImageFormat& format, int channels, const ocl::Context& context) {
    if (image.host) return host_values(image, format, channels);
    const size_t pitch = row_pitch(image, format);
    std::vector<std::byte> copy(pitch * (image.size.height - 1) + tight_pitch(image.size, format));
    ocl::checked("read a frame to diagnose it", [&] {
        if (image.buffer)
            context.queue().enqueueReadBuffer(cl::Buffer(image.buffer, true), CL_TRUE, first_byte(image, format),
                                              copy.size(), copy.data());
        if (image.image) {
            const ocl::ImageObject from(image);
            context.queue().enqueueReadImage(from.object, CL_TRUE, from.origin, from.region, pitch, 0, copy.data());
        }
    });
    return host_values({.host = copy.data(), .row_pitch = pitch, .size = image.size}, format, channels);
}

}  // namespace clarus
