#include "cli/contact_sheet.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>

#include "base/error.h"
#include "base/rounding.h"
#include "io/image.h"
#include "io/image_module.h"

namespace clarus::cli {
namespace {

constexpr int label_height = 36;
constexpr int font_size = 20;
constexpr int gap = 4;
constexpr int largest_side = 1 << 16;  // of a sheet or an image
constexpr std::array<float, 3> frame_color{1, 0.8f, 0};

Area parse_crop(const std::string& text) {
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
    return {x, y, width, height};
}

io::Pixels black(Size size) { return {size, 3, std::vector<float>(static_cast<size_t>(size.width) * size.height * 3)}; }

/// Copies the image's first three channels to where its upper left corner is to be.
void paste(io::Pixels& sheet, int x, int y, const io::Pixels& image) {
    for (int row = 0; row < image.size.height; ++row)
        for (int column = 0; column < image.size.width; ++column)
            for (int c = 0; c < 3; ++c) sheet.at(x + column, y + row, c) = image.at(column, row, c);
}

io::Pixels cut(const io::Pixels& image, const Area& area) {
    io::Pixels part = black({area.width, area.height});
    for (int row = 0; row < area.height; ++row)
        for (int column = 0; column < area.width; ++column)
            for (int c = 0; c < 3; ++c) part.at(column, row, c) = image.at(area.x + column, area.y + row, c);
    return part;
}

/// A frame one pixel wide, around the area's outermost pixels.
void draw_frame(io::Pixels& image, const Area& area) {
    const auto draw = [&](int x, int y) {
        for (int c = 0; c < 3; ++c) image.at(x, y, c) = frame_color[c];
    };
    const int right = area.x + area.width - 1, bottom = area.y + area.height - 1;
    for (int x = area.x; x <= right; ++x) draw(x, area.y), draw(x, bottom);
    for (int y = area.y; y <= bottom; ++y) draw(area.x, y), draw(right, y);
}

int scaled_height(Size size, int width) {
    const int64_t height = (int64_t{size.height} * width + size.width / 2) / size.width;
    return static_cast<int>(std::clamp<int64_t>(height, 1, largest_side));
}

int64_t column_height(const ContactSheet& options, Size size, int width) {
    int64_t height = label_height + scaled_height(size, width);
    for (const Area& crop : options.crops) height += gap + scaled_height({crop.width, crop.height}, width);
    return height;
}

// From top to bottom: the label, the whole picture with its crops framed, the crops enlarged to the column's width.
io::Pixels draw_column(const SheetColumn& column, const Reference& reference, const ContactSheet& options, Size& size) {
    const io::Pixels picture = read_display(column.file, reference);
    if (picture.channels < 3) fail(ErrorKind::file, "{} has no colour", column.file.string());
    if (size == Size{}) size = picture.size;
    if (picture.size != size)
        fail(ErrorKind::file, "{} is {}x{} pixels, the first column's image {}x{}", column.file.string(),
             picture.size.width, picture.size.height, size.width, size.height);

    const io::ImageModule& images = io::image_module();
    const auto widened = [&](const io::Pixels& image, io::ImageModule::Filter filter) {
        const int width = options.column_width > 0 ? options.column_width : size.width;
        return images.resize(image, {width, scaled_height(image.size, width)}, filter);
    };
    io::Pixels framed = cut(picture, {0, 0, size.width, size.height});
    for (const Area& crop : options.crops) draw_frame(framed, crop);
    const io::Pixels top = widened(framed, io::ImageModule::Filter::best);

    const int width = top.size.width;
    io::Pixels sheet = black({width, static_cast<int>(column_height(options, size, width))});
    images.write_text(sheet, gap, label_height - gap * 3, column.label, font_size);
    paste(sheet, 0, label_height, top);
    int y = label_height + top.size.height;
    for (const Area& crop : options.crops) {
        const io::Pixels enlarged = widened(cut(picture, crop), io::ImageModule::Filter::box);
        paste(sheet, 0, y + gap, enlarged);
        y += gap + enlarged.size.height;
    }
    return sheet;
}

}  // namespace

void ContactSheet::add_to(CLI::App& command) {
    CLI::Option& sheet =
        *command.add_option("--sheet", file, "Also a picture of one frame, the results and the reference side by side")
             ->type_name("FILE");
    command.add_option("--sheet-frame", frame, "Its name, such as 0012; the first by default")->needs(&sheet);
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
    command.add_option("--sheet-columns", columns, "Pictures in a row of the sheet; all of them by default")
        ->check(CLI::PositiveNumber)
        ->needs(&sheet);
    command
        .add_option("--column-width", column_width, "Of the sheet's pictures, in pixels; the images' width by default")
        ->check(CLI::Range(16, 16384))
        ->needs(&sheet);
}

void ContactSheet::check(const Reference& reference) const {
    if (file.empty()) return;
    const Size size = io::read_image(reference.file).size;
    for (const Area& crop : crops)
        if (crop.x + crop.width > size.width || crop.y + crop.height > size.height)
            fail(ErrorKind::invalid_argument, "--crop {},{},{},{} reaches beyond {}x{} pixels", crop.x, crop.y,
                 crop.width, crop.height, size.width, size.height);
    constexpr int64_t most = int64_t{1} << 27;  // pixels of a column, which takes 12 bytes each
    const int width = column_width > 0 ? column_width : size.width;
    const int64_t height = column_height(*this, size, width);
    if (width * height > most)
        fail(ErrorKind::invalid_argument,
             "--sheet: columns of {}x{} pixels are too large; take fewer crops or --column-width", width, height);
    if (height > largest_side)
        fail(ErrorKind::invalid_argument, "--sheet: {} pixels high are too many; take wider crops or --column-width",
             height);
}

void ContactSheet::draw(std::span<const SheetColumn> images, const Reference& reference) const {
    Size size;
    std::vector<io::Pixels> drawn;
    for (const SheetColumn& image : images) drawn.push_back(draw_column(image, reference, *this, size));

    const auto [width, height] = drawn.front().size;
    const int count = static_cast<int>(drawn.size()), in_row = columns > 0 ? std::min(columns, count) : count;
    io::Pixels sheet = black({in_row * (width + gap) - gap, ceil_divide(count, in_row) * (height + gap) - gap});
    for (int i = 0; i < count; ++i) paste(sheet, i % in_row * (width + gap), i / in_row * (height + gap), drawn[i]);
    io::write_image(file, sheet, io::SampleType::u8);
}

}  // namespace clarus::cli
