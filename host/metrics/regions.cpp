#include "metrics/regions.h"

#include <algorithm>

#include "base/error.h"
#include "metrics/display.h"
#include "metrics/psnr.h"

namespace clarus::metrics {
namespace {

constexpr std::ptrdiff_t least_pixels = 64;

std::optional<double> mean_inside(const SsimMap& map, const Mask& mask, int pitch) {
    double sum = 0;
    size_t count = 0;
    for (int y = 0; y < map.size.height; ++y) {
        const uint8_t* inside = &mask[static_cast<size_t>(y + SsimMap::margin) * pitch + SsimMap::margin];
        const double* values = &map.values[static_cast<size_t>(y) * map.size.width];
        for (int x = 0; x < map.size.width; ++x) {
            if (!inside[x]) continue;
            sum += values[x];
            ++count;
        }
    }
    if (count == 0) return std::nullopt;
    return sum / static_cast<double>(count);
}

}  // namespace

std::optional<RegionQuality> measure_region(const io::Pixels& image, const io::Pixels& reference,
                                            const std::optional<SsimMap>& map, const Mask& mask) {
    require_comparable(image, reference);
    if (mask.size() * 3 != image.values.size())
        fail(ErrorKind::invalid_argument, "a mask of {} pixels is not one of {}x{}", mask.size(), image.size.width,
             image.size.height);
    const std::ptrdiff_t count = std::ranges::count(mask, 1);
    if (count < least_pixels) return std::nullopt;
    double sum = 0;
    for (size_t i = 0; i < image.values.size(); ++i) {
        if (!mask[i / 3]) continue;
        const double difference = static_cast<double>(image.values[i]) - reference.values[i];
        sum += difference * difference;
    }
    return RegionQuality{psnr(sum / static_cast<double>(3 * count)),
                         map ? mean_inside(*map, mask, image.size.width) : std::nullopt};
}

}  // namespace clarus::metrics
