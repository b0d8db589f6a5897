#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imagebufalgo.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "base/error.h"
#include "io/channel_choice.h"
#include "io/file.h"
#include "io/image_module.h"
#include "io/png_check.h"

namespace clarus::io {
namespace {

// A damaged header may claim any size; beyond this no frame goes.
constexpr int64_t largest_pixel_count = int64_t{1} << 28;

// OpenImageIO joins several messages by line breaks.
std::string one_line(std::string message) {
    std::replace(message.begin(), message.end(), '\n', ' ');
    return message.empty() ? "the file is damaged" : message;
}

struct Window {
    int x, y, width, height;

    bool operator==(const Window&) const = default;
};

/// What of the plane a viewer shows: of OpenEXR the display window, in which the pixels that are there may be fewer, or
/// more; of other formats all pixels.
Window shown_window(const OIIO::ImageInput& input) {
    const OIIO::ImageSpec& spec = input.spec();
    if (std::string_view(input.format_name()) != "openexr") return {spec.x, spec.y, spec.width, spec.height};
    return {spec.full_x, spec.full_y, spec.full_width, spec.full_height};
}

/// Errors: file, where the part at which `input` is is no image of a size that may be read.
void check_part(const OIIO::ImageInput& input, const std::filesystem::path& path) {
    const OIIO::ImageSpec& spec = input.spec();
    const Window shown = shown_window(input);
    if (spec.width < 1 || spec.height < 1 || shown.width < 1 || shown.height < 1 || spec.nchannels < 1 ||
        spec.depth > 1 || spec.deep)
        fail(ErrorKind::file, "cannot read image {}: not a flat two-dimensional image", path.string());
    if (std::max(int64_t{spec.width} * spec.height, int64_t{shown.width} * shown.height) > largest_pixel_count ||
        spec.nchannels > 64)
        fail(ErrorKind::file, "cannot read image {}: {}x{} pixels with {} channels are too many", path.string(),
             std::max(spec.width, shown.width), std::max(spec.height, shown.height), spec.nchannels);
}

/// `of_png`: how much of it is to be whole.
std::unique_ptr<OIIO::ImageInput> open(const std::filesystem::path& path, PngPart of_png) {
    require_file(path);
    check_png(path, of_png);
    OIIO::ImageSpec request;
    request.attribute("oiio:UnassociatedAlpha", 1);
    auto input = OIIO::ImageInput::open(path.string(), &request);
    if (!input) fail(ErrorKind::file, "cannot read image {}: {}", path.string(), one_line(OIIO::geterror()));
    check_part(*input, path);
    return input;
}

template <typename T>
std::vector<std::byte> quantised(std::span<const float> values) {
    constexpr float top = std::numeric_limits<T>::max();
    std::vector<std::byte> bytes(values.size() * sizeof(T));
    T* out = reinterpret_cast<T*>(bytes.data());
    for (const float value : values) {
        const float positive = value > 0 ? value : 0;  // NaN too becomes 0
        *out++ = static_cast<T>(std::min(positive, 1.0f) * top + 0.5f);
    }
    return bytes;
}

/// Of whole numbers of more than 16 bits, and of doubles, what is read is floats.
SampleType sample_type(OIIO::TypeDesc format) {
    if (format == OIIO::TypeDesc::HALF) return SampleType::f16;
    if (format == OIIO::TypeDesc::UINT16 || format == OIIO::TypeDesc::INT16) return SampleType::u16;
    return format.size() == 1 ? SampleType::u8 : SampleType::f32;
}

OIIO::TypeDesc file_type(SampleType type) {
    switch (type) {
        case SampleType::u8:
            return OIIO::TypeDesc::UINT8;
        case SampleType::u16:
            return OIIO::TypeDesc::UINT16;
        case SampleType::f16:
            return OIIO::TypeDesc::HALF;
        case SampleType::f32:
            return OIIO::TypeDesc::FLOAT;
    }
    fail(ErrorKind::invalid_argument, "no such sample type: {}", static_cast<int>(type));
}

template <typename T>
std::vector<T> values_of(const OIIO::ImageSpec& spec, const char* name, OIIO::TypeDesc::BASETYPE type) {
    const OIIO::ParamValue* value = spec.find_attribute(name);
    if (!value || value->type().basetype != type) return {};
    const T* first = static_cast<const T*>(value->data());
    return {first, first + static_cast<size_t>(value->datasize()) / sizeof(T)};
}

ColorTags tags_of(const OIIO::ImageInput& input) {
    const OIIO::ImageSpec& spec = input.spec();
    const std::string space = spec.get_string_attribute("oiio:ColorSpace");
    // Other files are linear without saying so.
    const float linear = space == "Linear" && std::string_view(input.format_name()) == "png" ? 1 : 0;
    return {values_of<unsigned char>(spec, "ICCProfile", OIIO::TypeDesc::UINT8),
            values_of<float>(spec, "chromaticities", OIIO::TypeDesc::FLOAT),
            space.starts_with("Gamma") ? spec.get_float_attribute("oiio:Gamma") : linear};
}

void put(const ColorTags& tags, OIIO::ImageSpec& spec, std::string_view format) {
    if (!tags.icc.empty() && format != "openexr")
        spec.attribute("ICCProfile", OIIO::TypeDesc(OIIO::TypeDesc::UINT8, static_cast<int>(tags.icc.size())),
                       tags.icc.data());
    if (tags.chromaticities.size() == 8)
        spec.attribute("chromaticities", OIIO::TypeDesc(OIIO::TypeDesc::FLOAT, 8), tags.chromaticities.data());
    if (tags.gamma > 0) {
        spec.attribute("oiio:ColorSpace", "GammaCorrected");
        spec.attribute("oiio:Gamma", tags.gamma);
    }
}

/// How a picture is stored against how it is shown, as Exif has it: 1, as it is shown, to 8.
int orientation_of(const OIIO::ImageSpec& spec) {
    const int orientation = spec.get_int_attribute("Orientation", 1);
    return orientation >= 1 && orientation <= 8 ? orientation : 1;
}

/// Of those from 5 on rows are shown as columns.
Size shown_size(Size stored, int orientation) { return orientation < 5 ? stored : Size{stored.height, stored.width}; }

/// As it is shown.
Pixels turned(Pixels stored, int orientation) {
    if (orientation == 1) return stored;
    const bool is_turned = orientation >= 5;
    const bool from_right = orientation == 2 || orientation == 3 || orientation == 7 || orientation == 8;
    const bool from_below = orientation == 3 || orientation == 4 || orientation == 6 || orientation == 7;
    Pixels shown{shown_size(stored.size, orientation), stored.channels, {}};
    shown.values.reserve(stored.values.size());
    for (int y = 0; y < shown.size.height; ++y)
        for (int x = 0; x < shown.size.width; ++x) {
            const int along = is_turned ? y : x, across = is_turned ? x : y;
            const int from_x = from_right ? stored.size.width - 1 - along : along;
            const int from_y = from_below ? stored.size.height - 1 - across : across;
            for (int c = 0; c < stored.channels; ++c) shown.values.push_back(stored.at(from_x, from_y, c));
        }
    return shown;
}

/// The pixels as an ImageBuf; they must outlive it.
OIIO::ImageBuf wrap(const Pixels& pixels) {
    return {OIIO::ImageSpec(pixels.size.width, pixels.size.height, pixels.channels, OIIO::TypeDesc::FLOAT),
            const_cast<float*>(pixels.values.data())};
}

/// Of all parts.
std::vector<Channel> channels_of(OIIO::ImageInput& input) {
    const bool several = input.seek_subimage(1, 0);
    std::vector<Channel> channels;
    for (int part = 0; input.seek_subimage(part, 0); ++part) {
        const OIIO::ImageSpec& spec = input.spec();
        const std::string part_name = several ? spec.get_string_attribute("oiio:subimagename") : "";
        for (int place = 0; place < spec.nchannels; ++place)
            channels.push_back(channel_of(part, place, part_name, spec.channelnames[place]));
    }
    input.seek_subimage(0, 0);
    return channels;
}

/// What to read, with `input` at its part; none: the first channels of the first part. Errors: file, for what is not
/// there, may be several, or is in a part that shows other pixels than the first one.
std::optional<std::vector<Channel>> choose(OIIO::ImageInput& input, int most, const ChannelNames& named,
                                           const std::filesystem::path& path) {
    if (named == ChannelNames{} && std::string_view(input.format_name()) != "openexr") return std::nullopt;
    const Window shown = shown_window(input);
    auto chosen = chosen_channels(channels_of(input), most, named, path);
    if (!chosen || chosen->front().part == 0) return chosen;
    input.seek_subimage(chosen->front().part, 0);
    check_part(input, path);
    if (shown_window(input) != shown)
        fail(ErrorKind::file, "cannot read image {}: its part {} shows other pixels than its first part", path.string(),
             chosen->front().part_name);
    return chosen;
}

/// All of one layer.
bool read_channels(OIIO::ImageInput& input, const std::vector<Channel>& channels, Pixels& pixels) {
    const auto [first, last] = std::minmax_element(
        channels.begin(), channels.end(), [](const Channel& a, const Channel& b) { return a.place < b.place; });
    const int begin = first->place, count = last->place + 1 - begin;
    const size_t pixel_count = static_cast<size_t>(pixels.size.width) * pixels.size.height;
    std::vector<float> values(pixel_count * count);
    if (!input.read_image(first->part, 0, begin, begin + count, OIIO::TypeDesc::FLOAT, values.data())) return false;
    pixels.values.reserve(pixel_count * channels.size());
    for (size_t pixel = 0; pixel < pixel_count; ++pixel)
        for (const Channel& channel : channels) pixels.values.push_back(values[pixel * count + channel.place - begin]);
    return true;
}

/// The window of a plane in which the image begins at (0, 0) and is 0 outside.
Pixels part_of(const Pixels& pixels, const Window& window) {
    Pixels part{{window.width, window.height}, pixels.channels, {}};
    part.values.resize(static_cast<size_t>(window.width) * window.height * pixels.channels);
    const int64_t left = std::max(0, window.x);
    const int64_t right = std::min<int64_t>(pixels.size.width, int64_t{window.x} + window.width);
    for (int64_t y = 0; y < window.height && left < right; ++y) {
        const int64_t row = window.y + y;
        if (row < 0 || row >= pixels.size.height) continue;
        const float* from = pixels.values.data() + (row * pixels.size.width + left) * pixels.channels;
        std::copy_n(from, (right - left) * pixels.channels,
                    part.values.begin() + (y * window.width + left - window.x) * pixels.channels);
    }
    return part;
}

class OpenImageIo final : public ImageModule {
  public:
    ImageHeader read_header(const std::filesystem::path& path, int most_channels,
                            const ChannelNames& named) const override;
    Pixels read(const std::filesystem::path& path, int most_channels, const ChannelNames& named) const override;
    std::vector<unsigned char> encode(const std::filesystem::path& path, const Pixels& pixels, SampleType type,
                                      int png_compression, const ColorTags& tags) const override;
    Pixels resize(const Pixels& pixels, Size size, Filter filter) const override;
    void write_text(Pixels& pixels, int x, int y, const std::string& text, int height) const override;
};

ImageHeader OpenImageIo::read_header(const std::filesystem::path& path, int most_channels,
                                     const ChannelNames& named) const {
    const auto input = open(path, PngPart::before_pixels);
    const auto chosen = choose(*input, most_channels, named, path);
    const OIIO::ImageSpec& spec = input->spec();
    const auto [x, y, width, height] = shown_window(*input);
    const Size size = shown_size({width, height}, orientation_of(spec));
    if (!chosen) return {size, std::min(spec.nchannels, most_channels), sample_type(spec.format), tags_of(*input)};
    return {size, static_cast<int>(chosen->size()), sample_type(spec.channelformat(chosen->front().place)),
            tags_of(*input)};
}

Pixels OpenImageIo::read(const std::filesystem::path& path, int most_channels, const ChannelNames& named) const {
    const auto input = open(path, PngPart::all);
    const auto chosen = choose(*input, most_channels, named, path);
    const OIIO::ImageSpec spec = input->spec();
    const auto [x, y, width, height] = shown_window(*input);
    Pixels pixels{{spec.width, spec.height}, std::min(spec.nchannels, most_channels), {}};
    bool is_read = false;
    if (chosen) {
        pixels.channels = static_cast<int>(chosen->size());
        is_read = read_channels(*input, *chosen, pixels);
    } else {
        pixels.values.resize(spec.image_pixels() * pixels.channels);
        is_read = input->read_image(0, 0, 0, pixels.channels, OIIO::TypeDesc::FLOAT, pixels.values.data());
    }
    if (!is_read) fail(ErrorKind::file, "cannot read image {}: {}", path.string(), one_line(input->geterror()));
    if (x != spec.x || y != spec.y || Size{width, height} != pixels.size)
        pixels = part_of(pixels, {x - spec.x, y - spec.y, width, height});
    return turned(std::move(pixels), orientation_of(spec));
}

std::vector<unsigned char> OpenImageIo::encode(const std::filesystem::path& path, const Pixels& pixels, SampleType type,
                                               int png_compression, const ColorTags& tags) const {
    const size_t expected = static_cast<size_t>(std::max(pixels.size.width, 0)) * std::max(pixels.size.height, 0) *
                            std::max(pixels.channels, 0);
    if (expected == 0 || pixels.values.size() != expected)
        fail(ErrorKind::invalid_argument, "cannot write {}: {} values are no {}x{} image with {} channels",
             path.string(), pixels.values.size(), pixels.size.width, pixels.size.height, pixels.channels);

    // Encoded in memory: whether the disk took every byte is then ours to check, whatever the format. Declared before
    // the output, which may still write when it is destroyed.
    std::vector<unsigned char> encoded;
    OIIO::Filesystem::IOVecOutput memory(encoded);
    const auto output = OIIO::ImageOutput::create(path.filename().string());
    if (!output) fail(ErrorKind::file, "cannot write {}: {}", path.string(), one_line(OIIO::geterror()));
    if (!output->supports("ioproxy"))
        fail(ErrorKind::file, "cannot write {}: {} files can only be read; use png or exr", path.string(),
             output->format_name());

    OIIO::ImageSpec spec(pixels.size.width, pixels.size.height, pixels.channels, file_type(type));
    spec.attribute("oiio:UnassociatedAlpha", 1);
    if (output->format_name() == std::string_view("openexr")) {
        spec.attribute("compression", "zip");
        // Else it is the time of writing, and the same picture gives other bytes.
        spec.attribute("DateTime", "1970:01:01 00:00:00");
        // By default OpenImageIO takes the second of two for alpha; a motion image has none.
        if (pixels.channels == 2) spec.channelnames = {"R", "G"}, spec.alpha_channel = -1;
    }

    if (output->format_name() == std::string_view("png")) {
        spec.attribute("png:compressionLevel", png_compression);
        // Trying all of PNG's filters row by row then takes as long as the compression, for the size that Paeth's has.
        constexpr int paeth = 0x80;
        if (png_compression < default_png_compression) spec.attribute("png:filter", paeth);
    }
    if (output->format_name() == std::string_view("jpeg")) {
        spec.attribute("Compression", "jpeg:95");
        spec.attribute("jpeg:subsampling", "4:4:4");
    }

    put(tags, spec, output->format_name());
    const auto opens = [&] {
        output->set_ioproxy(&memory);
        return output->open(path.filename().string(), spec);
    };
    bool is_open = opens();
    if (!is_open && !tags.icc.empty()) {  // which may be damaged, or of another kind of colour
        spec.erase_attribute("ICCProfile");
        output->close();
        encoded.clear();
        memory.seek(0);
        is_open = opens();
    }
    if (!is_open) fail(ErrorKind::file, "cannot write {}: {}", path.string(), one_line(output->geterror()));
    if (output->spec().format != spec.format)
        fail(ErrorKind::file, "cannot write {}: a {} file cannot hold {} samples", path.string(), output->format_name(),
             spec.format.c_str());

    bool written = false;
    if (type == SampleType::u8) {
        written = output->write_image(spec.format, quantised<uint8_t>(pixels.values).data());
    } else if (type == SampleType::u16) {
        written = output->write_image(spec.format, quantised<uint16_t>(pixels.values).data());
    } else {
        written = output->write_image(OIIO::TypeDesc::FLOAT, pixels.values.data());
    }
    if (!written || !output->close())
        fail(ErrorKind::file, "cannot write {}: {}", path.string(), one_line(output->geterror()));

    return encoded;
}

Pixels OpenImageIo::resize(const Pixels& pixels, Size size, Filter filter) const {
    Pixels result{size, pixels.channels, {}};
    result.values.resize(static_cast<size_t>(size.width) * size.height * pixels.channels);
    OIIO::ImageBuf buffer = wrap(result);
    if (!OIIO::ImageBufAlgo::resize(buffer, wrap(pixels), filter == Filter::box ? "box" : "", 0, buffer.roi()))
        fail(ErrorKind::file, "cannot resize an image: {}", one_line(buffer.geterror()));
    return result;
}

void OpenImageIo::write_text(Pixels& pixels, int x, int y, const std::string& text, int height) const {
    constexpr std::array<float, 3> white{1, 1, 1};
    OIIO::ImageBuf buffer = wrap(pixels);
    if (!OIIO::ImageBufAlgo::render_text(buffer, x, y, text, height, "DejaVuSans", white))
        fail(ErrorKind::file, "cannot write the labels, is the font DejaVu Sans (fonts-dejavu-core) there? {}",
             one_line(buffer.geterror()));
}

}  // namespace
}  // namespace clarus::io

extern "C" __attribute__((visibility("default"))) const clarus::io::ImageModule& clarus_images() {
    static const clarus::io::OpenImageIo instance;
    return instance;
}
