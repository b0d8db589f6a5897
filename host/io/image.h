#pragma once

#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include "clarus/types.h"

namespace clarus::io {

/// Interleaved floats, rows top to bottom. 8- and 16-bit files are normalised to [0, 1]; nothing else is converted.
struct Pixels {
    Size size;
    int channels = 0;
    std::vector<float> values;  // size.width * size.height * channels

    float& at(int x, int y, int channel) {
        return values[(static_cast<size_t>(y) * size.width + x) * channels + channel];
    }
    float at(int x, int y, int channel) const {
        return values[(static_cast<size_t>(y) * size.width + x) * channels + channel];
    }
};

struct ImageHeader {
    Size size;
    int channels = 0;
};

/// What a file says of itself, without its pixels. Errors: file, naming it.
ImageHeader read_image_header(const std::filesystem::path& path);

/// Any format that OpenImageIO reads; of its channels the first `most_channels`. Alpha is left as stored (not
/// multiplied in). Errors: file, naming it.
Pixels read_image(const std::filesystem::path& path, int most_channels = std::numeric_limits<int>::max());

enum class SampleType { u8, u16, f16, f32 };

/// zlib's own default. 1 takes a quarter of the time, for files about a tenth larger.
constexpr int default_png_compression = 6;

/// A whole image file of the format that `name`'s extension tells, in memory. u8 and u16 clamp to [0, 1] and round to
/// nearest; a JPEG is of quality 95 with colour at full resolution; PNG takes zlib's level, 0 (none) to 9. Errors:
/// file, naming it and the cause.
std::vector<unsigned char> encode_image(const std::filesystem::path& name, const Pixels& pixels, SampleType type,
                                        int png_compression = default_png_compression);

/// Writes what encode_image makes, under a temporary name first, so that a file under its final name is always
/// whole. Errors: file, naming it and the cause (permission, disk full).
void write_image(const std::filesystem::path& path, const Pixels& pixels, SampleType type,
                 int png_compression = default_png_compression);

}  // namespace clarus::io
