#pragma once

#include <optional>

#include "io/image.h"

namespace clarus::metrics {

/// Quality of linear radiance (docs/metrics.md, "Linear radiance").
struct RadianceQuality {
    std::optional<double> mean_ratio;  // of the image's mean to the reference's; none where that is black
    double relative_error = 0;
    double pq_psnr = 0;  // dB
};

/// Of images of exposed radiance (metrics/display.h). Errors: as mean_squared_error.
RadianceQuality measure_radiance(const io::Pixels& image, const io::Pixels& reference);

/// SMPTE ST 2084: the code, 0 to 1, of an exposed radiance of which 1 is shown at 100 cd/m²; all above 10,000 cd/m²
/// is 1.
double pq_code(double radiance);

}  // namespace clarus::metrics
