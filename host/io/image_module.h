#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "io/image.h"

namespace clarus::io {

/// All that Clarus asks of OpenImageIO outside the sample renderer. OpenImageIO comes with some 250 shared libraries,
/// so it is behind a module: a command that meets no image does not load them.
class ImageModule {
  public:
    // read_image_header, read_image and encode_image of io/image.h.
    virtual ImageHeader read_header(const std::filesystem::path& path, int most_channels,
                                    const ChannelNames& named) const = 0;
    virtual Pixels read(const std::filesystem::path& path, int most_channels, const ChannelNames& named) const = 0;
    virtual std::vector<unsigned char> encode(const std::filesystem::path& name, const Pixels& pixels, SampleType type,
                                              int png_compression, const ColorTags& tags) const = 0;

    enum class Filter { best, box };  // best: OpenImageIO's choice, which differs for larger and for smaller
    /// The image at another size. Errors: file.
    virtual Pixels resize(const Pixels& pixels, Size size, Filter filter) const = 0;

    /// Writes white letters whose base line begins at (x, y). Errors: file where the font DejaVu Sans is missing.
    virtual void write_text(Pixels& pixels, int x, int y, const std::string& text, int height) const = 0;

  protected:
    ~ImageModule() = default;
};

/// Thread-safe; loads the module at the first call. Errors: those of module_function.
const ImageModule& image_module();

}  // namespace clarus::io
