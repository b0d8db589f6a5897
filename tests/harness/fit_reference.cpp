#include "fit_reference.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "filter_kernels.h"

namespace clarus::test {
namespace {

/// Pixel `place` of an axis of `to` pixels, from one of `from` whose pixels `at` returns.
double fitted(const std::function<double(int)>& at, int from, int to, int place) {
    const auto pixel = [&](int i) { return at(std::clamp(i, 0, from - 1)); };
    double sum = 0, least = 1, greatest = 0;
    if (to > from) {
        const double u = (place + 0.5) * from / to - 0.5;
        const int whole = static_cast<int>(std::floor(u));
        for (int i = whole - 1; i <= whole + 2; ++i) sum += keys(u - i) * pixel(i);
        least = std::min(pixel(whole), pixel(whole + 1));
        greatest = std::max(pixel(whole), pixel(whole + 1));
    } else {
        for (int i = 0; i < from; ++i) {
            // In 1 / to pixels, which are whole.
            const int covered = std::min((i + 1) * to, (place + 1) * from) - std::max(i * to, place * from);
            if (covered <= 0) continue;
            sum += covered * pixel(i) / from;
            least = std::min(least, pixel(i));
            greatest = std::max(greatest, pixel(i));
        }
    }
    return std::clamp(sum, least, greatest);
}

}  // namespace

Planes expected_fit(const Planes& image, Size size) {
    const graph::Shape& in = image.shape;
    const auto shown = [&](int c, int x, int y) {
        const float v = image.at(c, x, y);
        return std::isnan(v) ? 0.0 : std::clamp<double>(v, 0, 1);
    };
    std::vector<double> along_y;
    for (int c = 0; c < in.channels; ++c)
        for (int y = 0; y < size.height; ++y)
            for (int x = 0; x < in.width; ++x)
                along_y.push_back(fitted([&](int row) { return shown(c, x, row); }, in.height, size.height, y));
    return planes({in.channels, size.height, size.width}, [&](int c, int x, int y) {
        const double* row = along_y.data() + (static_cast<size_t>(c) * size.height + y) * in.width;
        return static_cast<float>(fitted([&](int column) { return row[column]; }, in.width, size.width, x));
    });
}

}  // namespace clarus::test
