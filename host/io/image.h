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

/// How a file holds a channel's values.
enum class SampleType { u8, u16, f16, f32 };

/// What a file says that its colours mean, where it says anything; nothing is converted by it.
struct ColorTags {
    std::vector<unsigned char> icc{};     // an ICC profile
    std::vector<float> chromaticities{};  // CIE x and y of red, green, blue and white: of OpenEXR files
    float gamma = 0;                      // of the encoding, 2.2 as a rule: of PNG files

    bool operator==(const ColorTags&) const = default;
};

struct ImageHeader {
    Size size;
    int channels = 0;
    SampleType type = SampleType::u8;  // the nearest to the file's own that holds all of its values
    ColorTags tags{};
};

/// The channels that are meant, of a file that has more. Without names they are chosen by those that renderers give.
struct ChannelNames {
    std::string part;                // of a multi-part OpenEXR file; any where it is empty
    std::vector<std::string> names;  // as the file has them, in the order in which they are read: "ViewLayer.Vector.X"

    bool operator==(const ChannelNames&) const = default;
};

constexpr int all_channels = std::numeric_limits<int>::max();

/// What read_image would give, without the pixels. Errors: read_image's.
ImageHeader read_image_header(const std::filesystem::path& path, int most_channels = all_channels,
                              const ChannelNames& named = {});

/// Any format that OpenImageIO reads; of its channels at most so many. Of an OpenEXR file that has more, one is depth,
/// two are motion, three are colour, and four are colour with its alpha, or three where it has none; of other files the
/// first are read, unless they are named. Alpha is left as stored (not multiplied in). Errors: file, naming it; where
/// it has not the named channels, or several may be meant, with all that it has.
Pixels read_image(const std::filesystem::path& path, int most_channels = all_channels, const ChannelNames& named = {});

/// The values that a file of these samples gives back: u8 and u16 clamp to [0, 1], NaN to 0, and round to nearest; f16
/// rounds to nearest even.
Pixels as_stored(Pixels pixels, SampleType type);

/// zlib's own default. 1 takes a quarter of the time, for files about a tenth larger.
constexpr int default_png_compression = 6;

/// A whole image file of the format that `name`'s extension tells, in memory. u8 and u16 clamp to [0, 1] and round to
/// nearest; a JPEG is of quality 95 with colour at full resolution; PNG takes zlib's level, 0 (none) to 9. Errors:
/// file, naming it and the cause. Of `tags` it has those that the format knows, and no ICC profile that is damaged.
std::vector<unsigned char> encode_image(const std::filesystem::path& name, const Pixels& pixels, SampleType type,
                                        int png_compression = default_png_compression, const ColorTags& tags = {});

/// Writes what encode_image makes, under a temporary name first, so that a file under its final name is always
/// whole. Errors: file, naming it and the cause (permission, disk full).
void write_image(const std::filesystem::path& path, const Pixels& pixels, SampleType type,
                 int png_compression = default_png_compression, const ColorTags& tags = {});

}  // namespace clarus::io
