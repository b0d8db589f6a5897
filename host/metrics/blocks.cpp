#include "metrics/blocks.h"

#include <algorithm>
#include <functional>
#include <numeric>

#include "base/error.h"
#include "base/rounding.h"
#include "metrics/display.h"

namespace clarus::metrics {

BlockErrors block_errors(const io::Pixels& image, const io::Pixels& reference) {
    require_comparable(image, reference);
    const auto [width, height] = image.size;
    BlockErrors blocks{{ceil_divide(width, BlockErrors::side), ceil_divide(height, BlockErrors::side)}, {}};
    for (int top = 0; top < height; top += BlockErrors::side) {
        for (int left = 0; left < width; left += BlockErrors::side) {
            const int right = std::min(left + BlockErrors::side, width);
            const int bottom = std::min(top + BlockErrors::side, height);
            double sum = 0;
            for (int y = top; y < bottom; ++y) {
                const size_t row = static_cast<size_t>(y) * width;
                for (size_t i = 3 * (row + left); i < 3 * (row + right); ++i) {
                    const double difference = static_cast<double>(image.values[i]) - reference.values[i];
                    sum += difference * difference;
                }
            }
            blocks.mean_squared_errors.push_back(sum / (3.0 * (right - left) * (bottom - top)));
        }
    }
    return blocks;
}

double worst_hundredth(std::vector<double> mean_squared_errors) {
    if (mean_squared_errors.empty()) fail(ErrorKind::invalid_argument, "there is no block to be the worst");
    const auto count = static_cast<std::ptrdiff_t>((mean_squared_errors.size() + 99) / 100);
    const auto end = mean_squared_errors.begin() + count;
    std::partial_sort(mean_squared_errors.begin(), end, mean_squared_errors.end(), std::greater());
    return std::accumulate(mean_squared_errors.begin(), end, 0.0) / static_cast<double>(count);
}

double share_worse(const BlockErrors& blocks, const BlockErrors& baseline) {
    if (blocks.grid != baseline.grid || blocks.mean_squared_errors.empty())
        fail(ErrorKind::invalid_argument, "{}x{} blocks cannot be compared with {}x{}", blocks.grid.width,
             blocks.grid.height, baseline.grid.width, baseline.grid.height);
    const size_t count = blocks.mean_squared_errors.size();
    size_t worse = 0;
    for (size_t i = 0; i < count; ++i) worse += blocks.mean_squared_errors[i] > baseline.mean_squared_errors[i];
    return static_cast<double>(worse) / static_cast<double>(count);
}

}  // namespace clarus::metrics
