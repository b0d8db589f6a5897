#include "metrics/psnr.h"

#include <algorithm>
#include <cmath>

#include "metrics/display.h"

namespace clarus::metrics {

double mean_squared_error(const io::Pixels& image, const io::Pixels& reference) {
    require_comparable(image, reference);
    double sum = 0;
    for (size_t i = 0; i < image.values.size(); ++i) {
        const double difference = static_cast<double>(image.values[i]) - reference.values[i];
        sum += difference * difference;
    }
    return sum / static_cast<double>(image.values.size());
}

double psnr(double mean_squared_error) { return std::min(-10 * std::log10(mean_squared_error), 100.0); }

}  // namespace clarus::metrics
