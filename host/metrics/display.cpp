#include "metrics/display.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "base/error.h"
#include "base/srgb.h"

namespace clarus::metrics {
namespace {

constexpr float infinity_becomes = 65504;

float exposed(float value, float exposure) {
    if (!(value > 0)) return 0;  // NaN too
    return std::min((std::isinf(value) ? infinity_becomes : value) * exposure, std::numeric_limits<float>::max());
}

std::array<float, 3> encode(std::array<float, 3> color, float exposure) {
    for (float& value : color) value = exposed(value, exposure);
    const float brightest = std::max({color[0], color[1], color[2]});
    for (float& value : color) value = encode_srgb(value / (1 + brightest));
    return color;
}

float clamped(float value) { return value > 0 ? std::min(value, 1.0f) : 0; }

void require_colors(const io::Pixels& pixels) {
    if (pixels.channels < 3)
        fail(ErrorKind::invalid_argument, "an image of {} channels cannot be compared; three are needed",
             pixels.channels);
}

}  // namespace

io::Pixels exposed_radiance(const io::Pixels& pixels, float exposure) {
    require_colors(pixels);
    io::Pixels radiance{pixels.size, 3, {}};
    radiance.values.reserve(static_cast<size_t>(pixels.size.width) * pixels.size.height * 3);
    for (size_t i = 0; i < pixels.values.size(); i += pixels.channels)
        for (size_t c = 0; c < 3; ++c) radiance.values.push_back(exposed(pixels.values[i + c], exposure));
    return radiance;
}

io::Pixels display_values(const io::Pixels& pixels, ColorSpace color_space, float exposure) {
    require_colors(pixels);
    io::Pixels display{pixels.size, 3, {}};
    display.values.reserve(static_cast<size_t>(pixels.size.width) * pixels.size.height * 3);
    for (size_t i = 0; i < pixels.values.size(); i += pixels.channels) {
        std::array<float, 3> color{pixels.values[i], pixels.values[i + 1], pixels.values[i + 2]};
        if (color_space == ColorSpace::linear) {
            color = encode(color, exposure);
        } else {
            for (float& value : color) value = clamped(value);
        }
        display.values.insert(display.values.end(), color.begin(), color.end());
    }
    return display;
}

void require_comparable(const io::Pixels& image, const io::Pixels& reference) {
    if (image.size != reference.size)
        fail(ErrorKind::invalid_argument, "{}x{} pixels cannot be compared with a reference of {}x{}", image.size.width,
             image.size.height, reference.size.width, reference.size.height);
    if (image.channels != 3 || reference.channels != 3)
        fail(ErrorKind::invalid_argument, "images of {} and {} channels cannot be compared; three are needed",
             image.channels, reference.channels);
    if (image.values.empty()) fail(ErrorKind::invalid_argument, "images without pixels cannot be compared");
}

}  // namespace clarus::metrics
