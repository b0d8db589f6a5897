#include "metrics/pixel_std.h"

#include <cmath>
#include <numeric>

#include "base/error.h"

namespace clarus::metrics {

void PixelStd::add(const io::Pixels& frame, bool is_static) {
    if (!is_static || is_first_) {
        if (const auto value = of_segment()) closed_.push_back(*value);
        count_ = 0;
        means_.assign(frame.values.size(), 0);
        squares_.assign(frame.values.size(), 0);
    }
    if (frame.values.size() != means_.size())
        fail(ErrorKind::invalid_argument, "the frames of a static segment differ in size");
    if (is_static || is_first_) {
        ++count_;
        for (size_t i = 0; i < means_.size(); ++i) {
            const double deviation = frame.values[i] - means_[i];
            means_[i] += deviation / static_cast<double>(count_);
            squares_[i] += deviation * (frame.values[i] - means_[i]);
        }
    }
    is_first_ = false;
}

std::optional<double> PixelStd::of_segment() const {
    if (count_ < 2) return std::nullopt;
    double sum = 0;
    for (const double squares : squares_) sum += std::sqrt(squares / static_cast<double>(count_));
    return 255 * sum / static_cast<double>(squares_.size());
}

std::optional<double> PixelStd::mean() const {
    std::vector<double> segments = closed_;
    if (const auto value = of_segment()) segments.push_back(*value);
    if (segments.empty()) return std::nullopt;
    return std::accumulate(segments.begin(), segments.end(), 0.0) / static_cast<double>(segments.size());
}

}  // namespace clarus::metrics
