#include "metrics/strred.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "base/error.h"
#include "metrics/display.h"

namespace clarus::metrics {
namespace {

constexpr int halvings = 3;
constexpr int block_side = 3;
constexpr size_t elements = block_side * block_side;
constexpr double noise_variance = 0.1;  // of the visual system, on 8-bit levels
constexpr int radius = 7;
constexpr double sigma = 1.42;  // puts the band's peak half way to the highest frequency

using Taps = std::array<double, 2 * radius + 1>;
using Matrix = std::array<std::array<double, elements>, elements>;

Band luma(const io::Pixels& image) {
    Band band{image.size, {}};
    band.values.reserve(image.values.size() / 3);
    for (size_t i = 0; i < image.values.size(); i += 3)
        band.values.push_back(255 *
                              (0.299 * image.values[i] + 0.587 * image.values[i + 1] + 0.114 * image.values[i + 2]));
    return band;
}

/// A row's or column's index, mirrored at the edges without repeating them.
int mirrored(int i, int count) {
    if (count == 1) return 0;
    const int period = 2 * (count - 1);
    i = std::abs(i) % period;
    return i < count ? i : period - i;
}

/// Correlation along one axis with taps around each element.
template <size_t Count>
Band filtered(const Band& band, const std::array<double, Count>& taps, bool along_x) {
    constexpr int reach = static_cast<int>(Count) / 2;
    const auto [width, height] = band.size;
    Band out{band.size, std::vector<double>(band.values.size())};
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            double sum = 0;
            for (int k = -reach; k <= reach; ++k)
                sum += taps[k + reach] *
                       (along_x ? band.at(mirrored(x + k, width), y) : band.at(x, mirrored(y + k, height)));
            out.values[static_cast<size_t>(y) * width + x] = sum;
        }
    return out;
}

Band halved(const Band& band) {
    constexpr std::array<double, 5> binomial{1.0 / 16, 4.0 / 16, 6.0 / 16, 4.0 / 16, 1.0 / 16};
    const Band smooth = filtered(filtered(band, binomial, true), binomial, false);
    Band half{{(band.size.width + 1) / 2, (band.size.height + 1) / 2}, {}};
    for (int y = 0; y < half.size.height; ++y)
        for (int x = 0; x < half.size.width; ++x) half.values.push_back(smooth.at(2 * x, 2 * y));
    return half;
}

Taps gaussian() {
    Taps taps;
    double sum = 0;
    for (int i = -radius; i <= radius; ++i) sum += taps[i + radius] = std::exp(-i * i / (2 * sigma * sigma));
    for (double& tap : taps) tap /= sum;
    return taps;
}

/// Its fifth derivative, with a gain of 1 at the frequency where that is largest.
Taps fifth_derivative() {
    Taps taps = gaussian();
    for (int i = -radius; i <= radius; ++i) {
        const double t = i / sigma;
        taps[i + radius] *= t * (t * t * (t * t - 10) + 15);
    }
    const double peak = std::sqrt(5.0) / sigma;
    double gain = 0;
    for (int i = -radius; i <= radius; ++i) gain += taps[i + radius] * std::sin(peak * i);
    for (double& tap : taps) tap /= std::abs(gain);
    return taps;
}

/// Eigenvalues of a symmetric matrix, and eigenvectors as rows, by Jacobi's rotations.
struct Eigen {
    std::array<double, elements> values;
    Matrix vectors;
};

Eigen eigen(Matrix a) {
    Eigen result{{}, {}};
    Matrix& v = result.vectors;
    for (size_t i = 0; i < elements; ++i) v[i][i] = 1;
    for (int sweep = 0; sweep < 30; ++sweep)
        for (size_t p = 0; p < elements; ++p)
            for (size_t q = p + 1; q < elements; ++q) {
                if (a[p][q] == 0) continue;
                const double theta = (a[q][q] - a[p][p]) / (2 * a[p][q]);
                const double t = (theta >= 0 ? 1 : -1) / (std::abs(theta) + std::hypot(theta, 1));
                const double c = 1 / std::hypot(t, 1), s = t * c;
                for (size_t k = 0; k < elements; ++k) {
                    const double x = a[k][p], y = a[k][q];
                    a[k][p] = c * x - s * y;
                    a[k][q] = s * x + c * y;
                }
                for (size_t k = 0; k < elements; ++k) {
                    const double x = a[p][k], y = a[q][k];
                    a[p][k] = c * x - s * y;
                    a[q][k] = s * x + c * y;
                }
                for (size_t k = 0; k < elements; ++k) {
                    const double x = v[p][k], y = v[q][k];
                    v[p][k] = c * x - s * y;
                    v[q][k] = s * x + c * y;
                }
            }
    for (size_t i = 0; i < elements; ++i) result.values[i] = a[i][i];
    return result;
}

using Block = std::array<double, elements>;

std::vector<Block> blocks_of(const Band& band) {
    std::vector<Block> blocks;
    for (int top = 0; top + block_side <= band.size.height; top += block_side)
        for (int left = 0; left + block_side <= band.size.width; left += block_side) {
            Block& block = blocks.emplace_back();
            for (size_t i = 0; i < elements; ++i)
                block[i] = band.at(left + static_cast<int>(i) % block_side, top + static_cast<int>(i) / block_side);
        }
    return blocks;
}

/// Weighted by the block's own scale and, for the temporal part, by that of the band it is a difference of.
std::vector<double> weighted(const BlockEntropies& blocks, const std::vector<double>* more) {
    std::vector<double> out = blocks.entropies;
    for (size_t i = 0; i < out.size(); ++i) out[i] *= blocks.weights[i] * (more ? (*more)[i] : 1);
    return out;
}

}  // namespace

Band oriented_band(const io::Pixels& image) {
    require_comparable(image, image);
    Band band = luma(image);
    for (int i = 0; i < halvings; ++i) band = halved(band);
    return filtered(filtered(band, fifth_derivative(), true), gaussian(), false);
}

BlockEntropies block_entropies(const Band& band) {
    std::vector<Block> blocks = blocks_of(band);
    if (blocks.size() < elements) return {};
    Matrix covariance{};
    Block mean{};
    for (const Block& block : blocks)
        for (size_t i = 0; i < elements; ++i) mean[i] += block[i] / static_cast<double>(blocks.size());
    for (Block& block : blocks)
        for (size_t i = 0; i < elements; ++i) block[i] -= mean[i];
    for (const Block& block : blocks)
        for (size_t i = 0; i < elements; ++i)
            for (size_t j = 0; j < elements; ++j)
                covariance[i][j] += block[i] * block[j] / static_cast<double>(blocks.size());
    const Eigen axes = eigen(covariance);
    const double least = 1e-10 * std::max(*std::ranges::max_element(axes.values), 1.0);

    BlockEntropies out;
    for (const Block& block : blocks) {
        // The block's scale s² by maximum likelihood, along the axes in which blocks differ at all.
        double scale = 0, entropy = 0;
        for (size_t k = 0; k < elements; ++k) {
            if (axes.values[k] <= least) continue;
            double along = 0;
            for (size_t i = 0; i < elements; ++i) along += axes.vectors[k][i] * block[i];
            scale += along * along / axes.values[k] / elements;
        }
        for (const double variance : axes.values)
            entropy +=
                std::log2(2 * std::numbers::pi * std::numbers::e * (scale * std::max(variance, 0.0) + noise_variance)) /
                2;
        out.entropies.push_back(entropy);
        out.weights.push_back(std::log2(1 + scale));
    }
    return out;
}

StrredFrame strred_frame(const io::Pixels& image, const StrredFrame* previous) {
    StrredFrame frame{oriented_band(image), {}, {}};
    const BlockEntropies spatial = block_entropies(frame.band);
    frame.spatial = weighted(spatial, nullptr);
    if (!previous) return frame;
    if (previous->band.size != frame.band.size)
        fail(ErrorKind::invalid_argument, "the frames of a sequence differ in size");
    Band difference = frame.band;
    for (size_t i = 0; i < difference.values.size(); ++i) difference.values[i] -= previous->band.values[i];
    frame.temporal = weighted(block_entropies(difference), &spatial.weights);
    return frame;
}

std::optional<double> entropic_difference(const std::vector<double>& entropies, const std::vector<double>& reference) {
    if (entropies.size() != reference.size())
        fail(ErrorKind::invalid_argument, "{} blocks cannot be compared with {}", entropies.size(), reference.size());
    if (entropies.empty()) return std::nullopt;
    double sum = 0;
    for (size_t i = 0; i < entropies.size(); ++i) sum += std::abs(entropies[i] - reference[i]);
    return sum / static_cast<double>(entropies.size());
}

}  // namespace clarus::metrics
