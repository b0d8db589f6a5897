#include "cli/contact_sheet.h"

#include <OpenImageIO/imagebufalgo.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>

#include "base/error.h"
#include "base/rounding.h"
#include "io/image.h"

namespace clarus::cli {
namespace {

constexpr int label_height = 36;
constexpr int font_size = 20;
constexpr int gap = 4;
constexpr int largest_side = 1 << 16;  // of a sheet or an image
constexpr const char* font = "DejaVuSans";
constexpr std::array<float, 3> white{1, 1, 1};
constexpr std::array<float, 3> frame_color{1, 0.8f, 0};

OIIO::ROI parse_crop(const std::string& text) {
    std::array<int, 4> numbers{};
    const char* position = text.data();
    const char* const end = position + text.size();
    for (size_t i = 0; i < numbers.size(); ++i) {
        const auto [next, error] = std::from_chars(position, end, numbers[i]);
        const bool separated = i + 1 < numbers.size() ? next != end && *next == ',' : next == end;
        const int least = i < 2 ? 0 : 1;
        if (error != std::errc{} || !separated || numbers[i] < least || numbers[i] > largest_side)
            throw CLI::ValidationError("--crop", text + " is not of the form X,Y,W,H");
        position = next + 1;
    }
    const auto [x, y, width, height] = numbers;
    return {x, x + width, y, y + height};
}

void require(bool success, const OIIO::ImageBuf& image) {
    if (!success) fail(ErrorKind::file, "cannot draw the sheet: {}", image.geterror());
}

// Wraps the pixels, which must outlive it.
OIIO::ImageBuf wrap(io::Pixels& pixels) {
    return {OIIO::ImageSpec(pixels.size.width, pixels.size.height, pixels.channels, OIIO::TypeDesc::FLOAT),
            pixels.values.data()};
}

OIIO::ImageBuf resized(const OIIO::ImageBuf& image, int width, int height, const char* filter) {
    OIIO::ImageBuf result;
    require(OIIO::ImageBufAlgo::resize(result, image, filter, 0, OIIO::ROI(0, width, 0, height)), result);
    return result;
}

int scaled_height(const OIIO::ROI& area, int width) {
    const int64_t height = (int64_t{area.height()} * width + area.width() / 2) / area.width();
    return static_cast<int>(std::clamp<int64_t>(height, 1, largest_side));
}

int64_t column_height(const ContactSheet& options, Size size, int width) {
    int64_t height = label_height + scaled_height({0, size.width, 0, size.height}, width);
    for (const OIIO::ROI& crop : options.crops) height += gap + scaled_height(crop, width);
    return height;
}

// From top to bottom: the label, the whole picture with its crops framed, the crops enlarged to the column's width.
OIIO::ImageBuf draw_column(const SheetColumn& column, const Reference& reference, const ContactSheet& options,
                           Size& size) {
    io::Pixels pixels = read_display(column.file, reference);
    if (pixels.channels < 3) fail(ErrorKind::file, "{} has no colour", column.file.string());
    if (size == Size{}) size = pixels.size;
    if (pixels.size != size)
        fail(ErrorKind::file, "{} is {}x{} pixels, the first column's image {}x{}", column.file.string(),
             pixels.size.width, pixels.size.height, size.width, size.height);

    const OIIO::ImageBuf picture = wrap(pixels);
    const OIIO::ROI whole(0, size.width, 0, size.height);
    const int width = options.column_width > 0 ? options.column_width : size.width;
    const int height = static_cast<int>(column_height(options, size, width));

    OIIO::ImageBuf sheet(OIIO::ImageSpec(width, height, 3, OIIO::TypeDesc::FLOAT));
    require(OIIO::ImageBufAlgo::zero(sheet), sheet);
    if (!OIIO::ImageBufAlgo::render_text(sheet, gap, label_height - gap * 3, column.label, font_size, font, white))
        fail(ErrorKind::file, "cannot write the labels, is the font DejaVu Sans (fonts-dejavu-core) there? {}",
             sheet.geterror());

    OIIO::ImageBuf framed(picture.spec());
    require(OIIO::ImageBufAlgo::copy(framed, picture), framed);
    for (const OIIO::ROI& crop : options.crops)
        require(
            OIIO::ImageBufAlgo::render_box(framed, crop.xbegin, crop.ybegin, crop.xend - 1, crop.yend - 1, frame_color),
            framed);
    const OIIO::ImageBuf top = resized(framed, width, scaled_height(whole, width), "");
    require(OIIO::ImageBufAlgo::paste(sheet, 0, label_height, 0, 0, top), sheet);

    int y = label_height + top.spec().height;
    for (const OIIO::ROI& crop : options.crops) {
        const OIIO::ImageBuf enlarged =
            resized(OIIO::ImageBufAlgo::cut(picture, crop), width, scaled_height(crop, width), "box");
        require(OIIO::ImageBufAlgo::paste(sheet, 0, y + gap, 0, 0, enlarged), sheet);
        y += gap + enlarged.spec().height;
    }
    return sheet;
}

}  // namespace

void ContactSheet::add_to(CLI::App& command) {
    CLI::Option& sheet =
        *command.add_option("--sheet", file, "Also a picture of one frame, the results and the reference side by side")
             ->type_name("FILE");
    command.add_option("--sheet-frame", frame, "Its name, such as 0012; the first unless told")->needs(&sheet);
    command
        .add_option_function<std::vector<std::string>>(
            "--crop",
            [this](const std::vector<std::string>& texts) {
                for (const std::string& text : texts) crops.push_back(parse_crop(text));
            },
            "A part of the sheet's pictures, enlarged to their width. May be repeated")
        ->type_name("X,Y,W,H")
        ->allow_extra_args(false)
        ->needs(&sheet);
    command.add_option("--sheet-columns", columns, "Pictures in a row of the sheet; all of them unless told")
        ->check(CLI::PositiveNumber)
        ->needs(&sheet);
    command
        .add_option("--column-width", column_width, "Of the sheet's pictures, in pixels; the images' width unless told")
        ->check(CLI::Range(16, 16384))
        ->needs(&sheet);
}

void ContactSheet::check(const Reference& reference) const {
    if (file.empty()) return;
    const Size size = io::read_image(reference.file).size;
    for (const OIIO::ROI& crop : crops)
        if (crop.xend > size.width || crop.yend > size.height)
            fail(ErrorKind::invalid_argument, "--crop {},{},{},{} reaches beyond {}x{} pixels", crop.xbegin,
                 crop.ybegin, crop.width(), crop.height(), size.width, size.height);
    const int64_t height = column_height(*this, size, column_width > 0 ? column_width : size.width);
    if (height > largest_side)
        fail(ErrorKind::invalid_argument, "--sheet: {} pixels high are too many; take wider crops or --column-width",
             height);
}

void ContactSheet::draw(std::span<const SheetColumn> images, const Reference& reference) const {
    Size size;
    std::vector<OIIO::ImageBuf> drawn;
    for (const SheetColumn& image : images) drawn.push_back(draw_column(image, reference, *this, size));

    const int width = drawn.front().spec().width, height = drawn.front().spec().height;
    const int count = static_cast<int>(drawn.size()), in_row = columns > 0 ? std::min(columns, count) : count;
    OIIO::ImageBuf sheet(OIIO::ImageSpec(in_row * (width + gap) - gap,
                                         ceil_divide(count, in_row) * (height + gap) - gap, 3, OIIO::TypeDesc::FLOAT));
    require(OIIO::ImageBufAlgo::zero(sheet), sheet);
    for (int i = 0; i < count; ++i)
        require(
            OIIO::ImageBufAlgo::paste(sheet, i % in_row * (width + gap), i / in_row * (height + gap), 0, 0, drawn[i]),
            sheet);

    io::Pixels pixels{{sheet.spec().width, sheet.spec().height}, 3, {}};
    pixels.values.resize(sheet.spec().image_pixels() * 3);
    require(sheet.get_pixels(sheet.roi(), OIIO::TypeDesc::FLOAT, pixels.values.data()), sheet);
    io::write_image(file, pixels, io::SampleType::u8);
}

}  // namespace clarus::cli
