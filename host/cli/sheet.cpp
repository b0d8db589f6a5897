#include <OpenImageIO/imagebufalgo.h>
#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "base/error.h"
#include "cli/commands.h"
#include "cli/image_folder.h"
#include "io/image.h"

namespace clarus::cli {
namespace {

constexpr int label_height = 36;
constexpr int font_size = 20;
constexpr int gap = 4;
constexpr const char* font = "DejaVuSans";
constexpr std::array<float, 3> white{1, 1, 1};
constexpr std::array<float, 3> frame_color{1, 0.8f, 0};

struct Column {
    std::string label;
    std::filesystem::path folder;
};

struct SheetOptions {
    std::vector<Column> columns;
    std::string frame;
    std::vector<OIIO::ROI> crops;
    int column_width = 0;
    std::filesystem::path output;
};

Column parse_column(const std::string& text) {
    const size_t equals = text.find('=');
    if (equals == std::string::npos || equals + 1 == text.size())
        throw CLI::ValidationError("--column", text + " is not of the form LABEL=DIR");
    return {text.substr(0, equals), text.substr(equals + 1)};
}

OIIO::ROI parse_crop(const std::string& text) {
    std::array<int, 4> numbers{};
    const char* position = text.data();
    const char* const end = position + text.size();
    for (size_t i = 0; i < numbers.size(); ++i) {
        const auto [next, error] = std::from_chars(position, end, numbers[i]);
        const bool separated = i + 1 < numbers.size() ? next != end && *next == ',' : next == end;
        if (error != std::errc{} || !separated || numbers[i] < (i < 2 ? 0 : 1))
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
    return (area.height() * width + area.width() / 2) / area.width();
}

// From top to bottom: the label, the whole picture with its crops framed, the crops enlarged to the column's width.
OIIO::ImageBuf draw_column(const Column& column, const SheetOptions& options, Size& size) {
    const std::filesystem::path file = require_image(images_in(column.folder), options.frame, column.folder);
    io::Pixels pixels = io::read_image(file);
    if (pixels.channels < 3) fail(ErrorKind::file, "{} has no colour", file.string());
    if (size == Size{}) size = pixels.size;
    if (pixels.size != size)
        fail(ErrorKind::file, "{} is {}x{} pixels, the first column's image {}x{}", file.string(), pixels.size.width,
             pixels.size.height, size.width, size.height);

    const OIIO::ImageBuf picture = wrap(pixels);
    const OIIO::ROI whole(0, size.width, 0, size.height);
    const int width = options.column_width > 0 ? options.column_width : size.width;
    int height = label_height + scaled_height(whole, width);
    for (const OIIO::ROI& crop : options.crops) {
        if (crop.xend > size.width || crop.yend > size.height)
            fail(ErrorKind::invalid_argument, "--crop {},{},{},{} reaches beyond {}x{} pixels", crop.xbegin,
                 crop.ybegin, crop.width(), crop.height(), size.width, size.height);
        height += gap + scaled_height(crop, width);
    }

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

void draw_sheet(const SheetOptions& options) {
    Size size;
    std::vector<OIIO::ImageBuf> columns;
    for (const Column& column : options.columns) columns.push_back(draw_column(column, options, size));

    const int width = columns.front().spec().width, height = columns.front().spec().height;
    const int count = static_cast<int>(columns.size());
    OIIO::ImageBuf sheet(OIIO::ImageSpec(count * (width + gap) - gap, height, 3, OIIO::TypeDesc::FLOAT));
    require(OIIO::ImageBufAlgo::zero(sheet), sheet);
    for (int i = 0; i < count; ++i)
        require(OIIO::ImageBufAlgo::paste(sheet, i * (width + gap), 0, 0, 0, columns[i]), sheet);

    io::Pixels pixels{{sheet.spec().width, sheet.spec().height}, 3, {}};
    pixels.values.resize(sheet.spec().image_pixels() * 3);
    require(sheet.get_pixels(sheet.roi(), OIIO::TypeDesc::FLOAT, pixels.values.data()), sheet);
    io::write_image(options.output, pixels, io::SampleType::u8);
}

}  // namespace

void add_sheet_command(CLI::App& app) {
    CLI::App& command = *app.add_subcommand("sheet", "One frame of several results side by side, with enlarged crops");
    const auto options = std::make_shared<SheetOptions>();
    command
        .add_option_function<std::vector<std::string>>(
            "--column",
            [options](const std::vector<std::string>& texts) {
                for (const std::string& text : texts) options->columns.push_back(parse_column(text));
            },
            "A column's label and its folder of images. May be repeated")
        ->type_name("LABEL=DIR")
        ->allow_extra_args(false)
        ->required();
    command.add_option("--frame", options->frame, "The frame's name, such as 0012")->required();
    command
        .add_option_function<std::vector<std::string>>(
            "--crop",
            [options](const std::vector<std::string>& texts) {
                for (const std::string& text : texts) options->crops.push_back(parse_crop(text));
            },
            "A part of the picture, enlarged to the column's width. May be repeated")
        ->type_name("X,Y,W,H")
        ->allow_extra_args(false);
    command.add_option("--column-width", options->column_width, "In pixels; the images' width unless told")
        ->check(CLI::Range(16, 16384));
    command.add_option("-o,--output", options->output, "The picture's file, PNG")->required()->type_name("FILE");
    command.footer(
        "Example:\n"
        "  clarus sheet --column bicubic=out/bicubic --column ENSS-S=out/enss-s --column reference=sequence/reference\n"
        "               --frame 0012 --crop 400,200,160,90 -o sheet.png");
    command.callback([options] { draw_sheet(*options); });
}

}  // namespace clarus::cli
