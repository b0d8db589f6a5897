#include "io/image_folder.h"

#include <algorithm>
#include <array>
#include <string_view>
#include <system_error>
#include <vector>

#include "base/error.h"
#include "base/lower_case.h"
#include "io/enclosure.h"
#include "io/image.h"

namespace clarus::io {

std::string extension_of(const std::filesystem::path& path) { return lower_case(path.extension().string()); }

namespace {

constexpr auto extensions =
    std::to_array<std::string_view>({".png", ".exr", ".tif", ".tiff", ".jpg", ".jpeg", ".tga", ".bmp", ".hdr"});

bool is_image(const std::filesystem::path& path) {
    return std::ranges::find(extensions, extension_of(path)) != extensions.end();
}

/// Of radiance by their kind; the others hold what a display shows.
ColorSpace color_space_of(const std::filesystem::path& image) {
    const std::string extension = extension_of(image);
    return extension == ".exr" || extension == ".hdr" ? ColorSpace::linear : ColorSpace::srgb;
}

bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// Takes the digits that a text begins with away from it; returned without zeros before them.
std::string_view take_number(std::string_view& text) {
    const size_t end = std::min(text.find_first_not_of("0123456789"), text.size());
    std::string_view number = text.substr(0, end);
    text.remove_prefix(end);
    number.remove_prefix(std::min(number.find_first_not_of('0'), number.size()));
    return number;
}

/// As people count: "frame9" before "frame10".
bool comes_before(std::string_view a, std::string_view b) {
    const std::string_view whole_a = a, whole_b = b;
    while (!a.empty() && !b.empty()) {
        if (is_digit(a.front()) && is_digit(b.front())) {
            const std::string_view x = take_number(a), y = take_number(b);
            if (x.size() != y.size()) return x.size() < y.size();
            if (x != y) return x < y;
        } else {
            if (a.front() != b.front()) return a.front() < b.front();
            a.remove_prefix(1);
            b.remove_prefix(1);
        }
    }
    if (a.empty() != b.empty()) return a.empty();
    return whole_a < whole_b;  // "01" and "1"
}

}  // namespace

std::map<std::string, std::filesystem::path> images_in(const std::filesystem::path& folder) {
    std::error_code error;
    std::map<std::string, std::filesystem::path> images;
    for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
        const std::filesystem::path& path = entry.path();
        if (!is_image(path)) continue;
        const auto [other, is_new] = images.emplace(path.stem().string(), path);
        if (!is_new)
            fail(ErrorKind::file, "{} and {} are one frame twice; move one of them away", other->second.string(),
                 path.string());
    }
    if (error) fail(ErrorKind::file, "cannot read the folder {}: {}", folder.string(), error.message());
    if (images.empty()) fail(ErrorKind::file, "there is no image in {}", folder.string());
    return images;
}

bool holds_images(const std::filesystem::path& path) {
    if (!is_directory(path)) return is_image(path) && exists(path);
    return std::ranges::any_of(std::filesystem::directory_iterator(path),
                               [](const auto& entry) { return is_image(entry.path()); });
}

Sequence read_images(const std::filesystem::path& path, double scale) {
    Sequence sequence;
    sequence.is_described = false;
    sequence.scale = scale;
    const auto add = [&](const std::string& name, const std::filesystem::path& image) {
        sequence.frames.emplace_back();
        sequence.frames.back().name = name;
        sequence.frames.back().color = image;
    };
    if (is_directory(path)) {
        sequence.folder = path;
        const Enclosure folder(path);
        for (const auto& [name, image] : images_in(path)) {
            folder.require(image);
            add(name, image);
        }
        std::ranges::sort(sequence.frames, comes_before, &FrameFiles::name);
    } else {
        sequence.folder = path.has_parent_path() ? path.parent_path() : ".";
        add(path.stem().string(), path);
    }
    const std::filesystem::path& first = sequence.frames.front().color;
    sequence.frames.front().reset = true;
    sequence.render_size = read_image_header(first).size;
    sequence.color_space = color_space_of(first);
    for (const FrameFiles& frame : sequence.frames)
        if (color_space_of(frame.color) != sequence.color_space)
            fail(ErrorKind::file,
                 "of {} and {} one holds linear radiance, the other sRGB; a sequence has one colour space",
                 first.string(), frame.color.string());
    return sequence;
}

}  // namespace clarus::io
