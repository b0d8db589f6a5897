#include "io/image.h"

#include <span>

#include "base/module.h"
#include "io/file.h"
#include "io/image_module.h"

namespace clarus::io {

const ImageModule& image_module() {
    static const ImageModule& module = module_function<const ImageModule&()>("clarus_images", "clarus_images")();
    return module;
}

ImageHeader read_image_header(const std::filesystem::path& path) { return image_module().read_header(path); }

Pixels read_image(const std::filesystem::path& path, int most_channels) {
    return image_module().read(path, most_channels);
}

std::vector<unsigned char> encode_image(const std::filesystem::path& name, const Pixels& pixels, SampleType type,
                                        int png_compression) {
    return image_module().encode(name, pixels, type, png_compression);
}

void write_image(const std::filesystem::path& path, const Pixels& pixels, SampleType type, int png_compression) {
    const std::vector<unsigned char> encoded = encode_image(path, pixels, type, png_compression);
    write_file_atomically(path, std::as_bytes(std::span(encoded)));
}

}  // namespace clarus::io
