#include "cli/compensated_rounding.h"

#include <algorithm>
#include <cmath>

namespace clarus::cli {
namespace {

/// Mean products of the columns, and a hundredth of their mean square more on the diagonal: patches are few, and other
/// frames' differ.
std::vector<double> mean_products(std::span<const float> patches, size_t size, size_t first, size_t columns) {
    constexpr double kDamping = 0.01, kSmallest = 1e-9;
    std::vector<double> result(columns * columns);
    const size_t count = patches.size() / size;
    for (size_t patch = 0; patch < count; ++patch) {
        const float* values = &patches[patch * size + first];
        for (size_t i = 0; i < columns; ++i) {
            const double value = values[i];
            double* row = &result[i * columns];
            for (size_t j = 0; j <= i; ++j) row[j] += value * values[j];
        }
    }
    double trace = 0;
    for (size_t i = 0; i < columns; ++i) trace += result[i * columns + i];
    const double damping = kDamping * trace / static_cast<double>(columns) + kSmallest;
    for (size_t i = 0; i < columns; ++i) {
        result[i * columns + i] += damping;
        for (size_t j = 0; j <= i; ++j) result[j * columns + i] = result[i * columns + j];
    }
    return result;
}

/// The lower triangle L of a positive matrix L Lᵀ.
std::vector<double> cholesky(const std::vector<double>& matrix, size_t n) {
    std::vector<double> lower(n * n);
    for (size_t i = 0; i < n; ++i) {
        for (size_t j = 0; j <= i; ++j) {
            double sum = matrix[i * n + j];
            for (size_t k = 0; k < j; ++k) sum -= lower[i * n + k] * lower[j * n + k];
            lower[i * n + j] = i == j ? std::sqrt(std::max(sum, 1e-300)) : sum / lower[j * n + j];
        }
    }
    return lower;
}

/// Of a matrix L Lᵀ.
std::vector<double> inverse(const std::vector<double>& lower, size_t n) {
    std::vector<double> columns(n * n);  // L⁻¹ transposed: rows are its columns
    for (size_t j = 0; j < n; ++j) {
        double* column = &columns[j * n];
        for (size_t i = j; i < n; ++i) {
            double sum = i == j ? 1 : 0;
            for (size_t k = j; k < i; ++k) sum -= lower[i * n + k] * column[k];
            column[i] = sum / lower[i * n + i];
        }
    }
    std::vector<double> result(n * n);
    for (size_t i = 0; i < n; ++i) {
        for (size_t j = 0; j <= i; ++j) {
            double sum = 0;
            for (size_t k = i; k < n; ++k) sum += columns[i * n + k] * columns[j * n + k];
            result[i * n + j] = result[j * n + i] = sum;
        }
    }
    return result;
}

}  // namespace

CompensatedRounding::CompensatedRounding(std::span<const float> patches, size_t size, size_t first, size_t columns)
    : size_(columns), squares_(mean_products(patches, size, first, columns)), factor_(columns * columns) {
    const std::vector<double> lower = cholesky(inverse(cholesky(squares_, size_), size_), size_);
    for (size_t i = 0; i < size_; ++i)
        for (size_t j = 0; j <= i; ++j) factor_[j * size_ + i] = lower[i * size_ + j];
}

std::vector<std::int8_t> CompensatedRounding::round(std::span<const float> weights, double scale, int most) const {
    std::vector<double> left(weights.begin(), weights.end());
    std::vector<std::int8_t> result(size_);
    for (size_t i = 0; i < size_; ++i) {
        const double* row = &factor_[i * size_];
        const double whole = std::clamp<double>(std::round(left[i] / scale), -most, most);
        result[i] = static_cast<std::int8_t>(whole);
        const double lost = (left[i] - scale * whole) / row[i];
        for (size_t j = i + 1; j < size_; ++j) left[j] -= lost * row[j];
    }
    return result;
}

double CompensatedRounding::error(std::span<const float> weights, std::span<const std::int8_t> rounded,
                                  double scale) const {
    std::vector<double> off(size_);
    for (size_t i = 0; i < size_; ++i) off[i] = weights[i] - scale * rounded[i];
    double sum = 0;
    for (size_t i = 0; i < size_; ++i) {
        double product = 0;
        for (size_t j = 0; j < size_; ++j) product += squares_[i * size_ + j] * off[j];
        sum += off[i] * product;
    }
    return sum;
}

}  // namespace clarus::cli
