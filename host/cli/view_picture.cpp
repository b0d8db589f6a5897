#include "cli/view_picture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace clarus::cli {
namespace {

using Color = std::array<float, 3>;

struct Range {
    float low = 0, high = 1;
};

Range grey_range(const std::vector<float>& values) {
    Range range;
    for (const float value : values) {
        if (!std::isfinite(value)) continue;
        range.low = std::min(range.low, value);
        range.high = std::max(range.high, value);
    }
    return range;
}

float longest_vector(const Upscaler::View& view) {
    float longest = 0;
    for (size_t i = 0; i < view.pixels.size(); i += 2) {
        const float length = std::hypot(view.pixels[i], view.pixels[i + 1]);
        if (std::isfinite(length)) longest = std::max(longest, length);
    }
    return longest;
}

// No motion is white; an invalid vector is black.
Color wheel_color(float x, float y, float longest) {
    if (!std::isfinite(x) || !std::isfinite(y)) return {0, 0, 0};
    const float saturation = longest > 0 ? std::hypot(x, y) / longest : 0;
    const float angle = std::atan2(y, x);
    Color color;
    for (int channel = 0; channel < 3; ++channel) {
        const float distance = std::cos(angle - static_cast<float>(channel) * 2 * std::numbers::pi_v<float> / 3);
        color[channel] = 1 - saturation * (1 - distance) / 2;
    }
    return color;
}

std::vector<Color> colors(const Upscaler::View& view) {
    const size_t channels = view.channels;
    std::vector<Color> result(view.pixels.size() / channels);
    const Range range = channels == 1 ? grey_range(view.pixels) : Range{};
    const float longest = channels == 2 ? longest_vector(view) : 0;
    for (size_t i = 0; i < result.size(); ++i) {
        const float* pixel = &view.pixels[i * channels];
        if (channels == 1) {
            result[i].fill((pixel[0] - range.low) / (range.high - range.low));
        } else if (channels == 2) {
            result[i] = wheel_color(pixel[0], pixel[1], longest);
        } else {
            result[i] = {pixel[0], pixel[1], pixel[2]};
        }
    }
    return result;
}

/// The channels beside and below each other in one channel of that size, by nearest.
Upscaler::View side_by_side(const Upscaler::View& view, Size size) {
    const int columns = static_cast<int>(std::ceil(std::sqrt(view.channels)));
    const int rows = (view.channels + columns - 1) / columns;
    Upscaler::View sheet{size, 1, std::vector<float>(static_cast<size_t>(size.width) * size.height)};
    for (int y = 0; y < size.height; ++y) {
        for (int x = 0; x < size.width; ++x) {
            // In units of a picture: which one, and where in it.
            const double across = (x + 0.5) * columns / size.width, down = (y + 0.5) * rows / size.height;
            const int channel = static_cast<int>(down) * columns + static_cast<int>(across);
            if (channel >= view.channels) continue;
            const int from_x = static_cast<int>((across - std::floor(across)) * view.size.width);
            const int from_y = static_cast<int>((down - std::floor(down)) * view.size.height);
            sheet.pixels[static_cast<size_t>(y) * size.width + x] =
                view.pixels[(static_cast<size_t>(from_y) * view.size.width + from_x) * view.channels + channel];
        }
    }
    return sheet;
}

}  // namespace

io::Pixels view_picture(const Upscaler::View& view, Size size) {
    if (view.channels > 3 || (view.maps && view.channels > 1)) return view_picture(side_by_side(view, size), size);
    const std::vector<Color> source = colors(view);
    // Blocks are whole pixels; the last ones may reach beyond the image.
    const int factor = std::max({1, (size.width + view.size.width - 1) / view.size.width,
                                 (size.height + view.size.height - 1) / view.size.height});
    // Of a frame that was rendered smaller, blocks would reach far beyond.
    const auto is_near = [&](int of_view, int side) { return of_view * factor - side < factor; };
    const bool whole = is_near(view.size.width, size.width) && is_near(view.size.height, size.height);
    io::Pixels picture{size, 3, {}};
    picture.values.reserve(static_cast<size_t>(size.width) * size.height * 3);
    for (int y = 0; y < size.height; ++y) {
        for (int x = 0; x < size.width; ++x) {
            const int from_x = whole ? x / factor : static_cast<int>((x + 0.5) * view.size.width / size.width);
            const int from_y = whole ? y / factor : static_cast<int>((y + 0.5) * view.size.height / size.height);
            const Color& color = source[static_cast<size_t>(from_y) * view.size.width + from_x];
            picture.values.insert(picture.values.end(), color.begin(), color.end());
        }
    }
    return picture;
}

}  // namespace clarus::cli
