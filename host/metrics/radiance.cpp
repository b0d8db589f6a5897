#include "metrics/radiance.h"

#include <algorithm>
#include <cmath>

#include "metrics/display.h"
#include "metrics/psnr.h"

namespace clarus::metrics {
namespace {

constexpr double least_radiance = 0.01;  // below it errors are absolute
constexpr double nits_of_one = 100, peak_nits = 10000;

}  // namespace

double pq_code(double radiance) {
    constexpr double m1 = 2610.0 / 16384, m2 = 2523.0 / 4096 * 128;
    constexpr double c1 = 3424.0 / 4096, c2 = 2413.0 / 4096 * 32, c3 = 2392.0 / 4096 * 32;
    const double power = std::pow(std::clamp(radiance * nits_of_one / peak_nits, 0.0, 1.0), m1);
    return std::pow((c1 + c2 * power) / (1 + c3 * power), m2);
}

RadianceQuality measure_radiance(const io::Pixels& image, const io::Pixels& reference) {
    require_comparable(image, reference);
    double sum = 0, reference_sum = 0, relative = 0, squares = 0;
    for (size_t i = 0; i < image.values.size(); ++i) {
        const double value = image.values[i], expected = reference.values[i];
        const double code_difference = pq_code(value) - pq_code(expected);
        sum += value;
        reference_sum += expected;
        relative += std::abs(value - expected) / (expected + least_radiance);
        squares += code_difference * code_difference;
    }
    const double count = static_cast<double>(image.values.size());
    return {reference_sum > 0 ? std::optional(sum / reference_sum) : std::nullopt, relative / count,
            psnr(squares / count)};
}

}  // namespace clarus::metrics
