#include "io/images.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <set>
#include <string>
#include <vector>

#include "base/error.h"
#include "io/image.h"

namespace clarus::io {
namespace {

namespace fs = std::filesystem;

constexpr std::array display_formats{".png", ".jpg", ".jpeg", ".bmp", ".tga", ".tif", ".tiff", ".webp", ".ppm"};
constexpr std::array linear_formats{".exr", ".hdr"};

std::string extension_of(const fs::path& path) {
    std::string extension = path.extension().string();
    std::ranges::transform(extension, extension.begin(), [](unsigned char c) { return std::tolower(c); });
    return extension;
}

bool is_linear(const fs::path& path) { return std::ranges::count(linear_formats, extension_of(path)) > 0; }

bool is_image(const fs::path& path) {
    return is_linear(path) || std::ranges::count(display_formats, extension_of(path)) > 0;
}

bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// Runs of digits by their value: the shorter one is less, once leading zeros are skipped.
bool comes_before(const std::string& a, const std::string& b) {
    size_t i = 0, j = 0;
    while (i < a.size() && j < b.size()) {
        if (!is_digit(a[i]) || !is_digit(b[j])) {
            if (a[i] != b[j]) return a[i] < b[j];
            ++i, ++j;
            continue;
        }
        const auto take_number = [](const std::string& text, size_t& at) {
            while (at + 1 < text.size() && text[at] == '0' && is_digit(text[at + 1])) ++at;
            const size_t from = at;
            while (at < text.size() && is_digit(text[at])) ++at;
            return text.substr(from, at - from);
        };
        const std::string first = take_number(a, i), second = take_number(b, j);
        if (first.size() != second.size()) return first.size() < second.size();
        if (first != second) return first < second;
    }
    if (i < a.size() || j < b.size()) return j < b.size();
    return a < b;  // 7 and 07
}

std::vector<fs::path> images_at(const fs::path& path) {
    if (!fs::is_directory(path)) return {path};
    std::vector<fs::path> images;
    for (const auto& entry : fs::directory_iterator(path))
        if (entry.is_regular_file() && is_image(entry.path())) images.push_back(entry.path());
    std::ranges::sort(images, comes_before, [](const fs::path& image) { return image.filename().string(); });
    return images;
}

}  // namespace

bool looks_like_images(const fs::path& path) {
    if (!fs::is_directory(path)) return fs::is_regular_file(path) && is_image(path);
    return std::ranges::any_of(fs::directory_iterator(path), [](const fs::directory_entry& entry) {
        return entry.is_regular_file() && is_image(entry.path());
    });
}

Sequence read_images(const fs::path& path, double scale) {
    const std::vector<fs::path> images = images_at(path);
    if (images.empty()) fail(ErrorKind::file, "the folder {} has no image", path.string());
    Sequence sequence;
    sequence.folder = fs::is_directory(path) ? path : path.has_parent_path() ? path.parent_path() : fs::path(".");
    sequence.scale = scale;
    sequence.render_size = read_image_header(images.front()).size;
    sequence.color_space = is_linear(images.front()) ? ColorSpace::linear : ColorSpace::srgb;
    std::set<std::string> names;
    for (const fs::path& image : images) {
        if (is_linear(image) != is_linear(images.front()))
            fail(ErrorKind::file, "{} is linear and {} is not: one sequence has one colour space",
                 (is_linear(image) ? image : images.front()).string(),
                 (is_linear(image) ? images.front() : image).string());
        if (!names.insert(image.stem().string()).second)
            fail(ErrorKind::file, "two images of {} are named {}, as their results would be", path.string(),
                 image.stem().string());
        FrameFiles frame;
        frame.color = image;
        frame.name = image.stem().string();
        sequence.frames.push_back(std::move(frame));
    }
    sequence.frames.front().reset = true;
    return sequence;
}

}  // namespace clarus::io
