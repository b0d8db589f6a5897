#include "metrics/ssim.h"

#include <array>
#include <cmath>
#include <numeric>
#include <vector>

#include "metrics/display.h"

namespace clarus::metrics {
namespace {

constexpr int window = 2 * SsimMap::margin + 1;
constexpr double sigma = 1.5;
constexpr double c1 = 0.01 * 0.01;
constexpr double c2 = 0.03 * 0.03;

std::array<double, window> gaussian() {
    std::array<double, window> weights;
    double sum = 0;
    for (int i = 0; i < window; ++i) {
        const double distance = i - window / 2;
        sum += weights[i] = std::exp(-distance * distance / (2 * sigma * sigma));
    }
    for (double& weight : weights) weight /= sum;
    return weights;
}

// A row of weighted sums: of both images, of the sum of their squares and of their product, which is all SSIM needs.
struct Moments {
    std::vector<double> x, y, squares, product;
    explicit Moments(size_t size) : x(size), y(size), squares(size), product(size) {}
};

void filter_columns(const float* x, const float* y, size_t pitch, const std::array<double, window>& weights,
                    Moments& out) {
    const size_t count = out.x.size();
    for (std::vector<double>* sums : {&out.x, &out.y, &out.squares, &out.product}) sums->assign(count, 0);
    for (const double weight : weights) {
        for (size_t i = 0; i < count; ++i) {
            const double a = x[i], b = y[i];
            out.x[i] += weight * a;
            out.y[i] += weight * b;
            out.squares[i] += weight * (a * a + b * b);
            out.product[i] += weight * (a * b);
        }
        x += pitch;
        y += pitch;
    }
}

void filter_row(const std::vector<double>& in, size_t channels, const std::array<double, window>& weights,
                std::vector<double>& out) {
    out.assign(out.size(), 0);
    for (size_t tap = 0; tap < window; ++tap) {
        const double weight = weights[tap];
        const double* shifted = in.data() + tap * channels;
        for (size_t i = 0; i < out.size(); ++i) out[i] += weight * shifted[i];
    }
}

}  // namespace

double SsimMap::mean() const {
    return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

std::optional<SsimMap> ssim_map(const io::Pixels& image, const io::Pixels& reference) {
    require_comparable(image, reference);
    const auto [width, height] = image.size;
    if (width < window || height < window) return std::nullopt;

    const std::array<double, window> weights = gaussian();
    const size_t channels = image.channels;
    const size_t pitch = width * channels;
    Moments columns(pitch), sums((width - window + 1) * channels);
    SsimMap map{{width - window + 1, height - window + 1}, {}};
    map.values.reserve(static_cast<size_t>(map.size.width) * map.size.height);
    for (int row = 0; row <= height - window; ++row) {
        filter_columns(&image.values[row * pitch], &reference.values[row * pitch], pitch, weights, columns);
        filter_row(columns.x, channels, weights, sums.x);
        filter_row(columns.y, channels, weights, sums.y);
        filter_row(columns.squares, channels, weights, sums.squares);
        filter_row(columns.product, channels, weights, sums.product);
        double total = 0;
        for (size_t i = 0; i < sums.x.size(); ++i) {
            const double mean_product = sums.x[i] * sums.y[i];
            const double mean_squares = sums.x[i] * sums.x[i] + sums.y[i] * sums.y[i];
            const double covariance = sums.product[i] - mean_product;
            const double variances = sums.squares[i] - mean_squares;
            total += (2 * mean_product + c1) * (2 * covariance + c2) / ((mean_squares + c1) * (variances + c2));
            if ((i + 1) % channels != 0) continue;
            map.values.push_back(total / static_cast<double>(channels));
            total = 0;
        }
    }
    return map;
}

std::optional<double> ssim(const io::Pixels& image, const io::Pixels& reference) {
    const std::optional<SsimMap> map = ssim_map(image, reference);
    return map ? std::optional(map->mean()) : std::nullopt;
}

}  // namespace clarus::metrics
