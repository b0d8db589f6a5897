#include "io/image.h"

#include <Imath/half.h>

#include <algorithm>
#include <cmath>
#include <span>

#include "base/module.h"
#include "io/file.h"
#include "io/image_module.h"

namespace clarus::io {

const ImageModule& image_module() {
    static const ImageModule& module = module_function<const ImageModule&()>("clarus_images", "clarus_images")();
    return module;
}

ImageHeader read_image_header(const std::filesystem::path& path, int most_channels, const ChannelNames& named) {
    return image_module().read_header(path, most_channels, named);
}

Pixels read_image(const std::filesystem::path& path, int most_channels, const ChannelNames& named) {
    return image_module().read(path, most_channels, named);
}

Pixels as_stored(Pixels pixels, SampleType type) {
    const auto in_steps = [&](float top) {
        for (float& value : pixels.values)
            value = std::floor((value > 0 ? std::min(value, 1.0f) : 0) * top + 0.5f) / top;
    };
    if (type == SampleType::u8) in_steps(255);
    if (type == SampleType::u16) in_steps(65535);
    if (type == SampleType::f16)
        for (float& value : pixels.values) value = Imath::half(value);
    return pixels;
}

std::vector<unsigned char> encode_image(const std::filesystem::path& name, const Pixels& pixels, SampleType type,
                                        int png_compression, const ColorTags& tags) {
    return image_module().encode(name, pixels, type, png_compression, tags);
}

void write_image(const std::filesystem::path& path, const Pixels& pixels, SampleType type, int png_compression,
                 const ColorTags& tags) {
    const std::vector<unsigned char> encoded = encode_image(path, pixels, type, png_compression, tags);
    write_file_atomically(path, std::as_bytes(std::span(encoded)));
}

}  // namespace clarus::io
