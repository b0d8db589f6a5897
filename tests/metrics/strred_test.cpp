#include "metrics/strred.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "clarus/error.h"

using clarus::Size;
using clarus::io::Pixels;
namespace metrics = clarus::metrics;
using metrics::Band;
using metrics::StrredFrame;

namespace {

Pixels noise(Size size, unsigned seed, float low = 0, float high = 1) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> distribution(low, high);
    Pixels pixels{size, 3, std::vector<float>(static_cast<size_t>(size.width) * size.height * 3)};
    for (float& value : pixels.values) value = distribution(random);
    return pixels;
}

Pixels mixed(const Pixels& a, const Pixels& b, float share) {
    Pixels out = a;
    for (size_t i = 0; i < out.values.size(); ++i) out.values[i] += share * (b.values[i] - out.values[i]);
    return out;
}

// A grating along x or y, which mirrors into itself at the edges, with so many pixels a period, of amplitude 0.4.
Pixels grating(Size size, double period, bool along_x) {
    Pixels pixels{size, 3, {}};
    for (int y = 0; y < size.height; ++y)
        for (int x = 0; x < size.width; ++x) {
            const double phase = 2 * std::numbers::pi * (along_x ? x : y) / period;
            pixels.values.insert(pixels.values.end(), 3, static_cast<float>(0.5 + 0.4 * std::cos(phase)));
        }
    return pixels;
}

double largest(const Band& band) {
    double most = 0;
    for (const double value : band.values) most = std::max(most, std::abs(value));
    return most;
}

// By definition: x in its covariance's terms through elimination, the entropy through a determinant.
using Matrix = std::vector<std::vector<double>>;

// Solves a·y = x in place, and returns the determinant of a.
double solve(Matrix a, std::vector<double>& x) {
    const size_t n = a.size();
    double determinant = 1;
    for (size_t k = 0; k < n; ++k) {
        size_t pivot = k;
        for (size_t i = k + 1; i < n; ++i)
            if (std::abs(a[i][k]) > std::abs(a[pivot][k])) pivot = i;
        if (pivot != k) determinant = -determinant;
        std::swap(a[k], a[pivot]);
        std::swap(x[k], x[pivot]);
        determinant *= a[k][k];
        for (size_t i = k + 1; i < n; ++i) {
            const double factor = a[i][k] / a[k][k];
            for (size_t j = k; j < n; ++j) a[i][j] -= factor * a[k][j];
            x[i] -= factor * x[k];
        }
    }
    for (size_t k = n; k-- > 0;) {
        for (size_t j = k + 1; j < n; ++j) x[k] -= a[k][j] * x[j];
        x[k] /= a[k][k];
    }
    return determinant;
}

metrics::BlockEntropies plain_entropies(const Band& band) {
    const int columns = band.size.width / 3, rows = band.size.height / 3;
    std::vector<std::vector<double>> blocks;
    for (int r = 0; r < rows; ++r)
        for (int c = 0; c < columns; ++c) {
            blocks.emplace_back();
            for (int i = 0; i < 9; ++i) blocks.back().push_back(band.at(3 * c + i % 3, 3 * r + i / 3));
        }
    const double count = static_cast<double>(blocks.size());
    for (int i = 0; i < 9; ++i) {
        double mean = 0;
        for (const auto& block : blocks) mean += block[i] / count;
        for (auto& block : blocks) block[i] -= mean;
    }
    Matrix covariance(9, std::vector<double>(9));
    for (const auto& block : blocks)
        for (int i = 0; i < 9; ++i)
            for (int j = 0; j < 9; ++j) covariance[i][j] += block[i] * block[j] / count;
    metrics::BlockEntropies out;
    for (const auto& block : blocks) {
        std::vector<double> y = block;
        solve(covariance, y);
        double scale = 0;
        for (int i = 0; i < 9; ++i) scale += block[i] * y[i] / 9;
        Matrix noisy = covariance;
        for (int i = 0; i < 9; ++i)
            for (int j = 0; j < 9; ++j) noisy[i][j] = scale * noisy[i][j] + (i == j ? 0.1 : 0);
        out.entropies.push_back(0.5 * std::log2(std::pow(2 * std::numbers::pi * std::numbers::e, 9) * solve(noisy, y)));
        out.weights.push_back(std::log2(1 + scale));
    }
    return out;
}

double spatial_difference(const Pixels& a, const Pixels& b) {
    return *metrics::entropic_difference(metrics::strred_frame(a, nullptr).spatial,
                                         metrics::strred_frame(b, nullptr).spatial);
}

}  // namespace

TEST_CASE("STRRED's band sees upright structure of some 32 pixels a period, and no other") {
    const Size size{257, 193};
    CHECK(metrics::oriented_band(grating(size, 32, true)).size == Size{33, 25});
    // Amplitude 0.4·255, less what halving thrice leaves of it.
    const double seen = largest(metrics::oriented_band(grating(size, 32, true)));
    CHECK(seen > 60);
    CHECK(seen < 110);
    CHECK(largest(metrics::oriented_band(grating(size, 256, true))) < 0.02 * seen);
    CHECK(largest(metrics::oriented_band(grating(size, 4, true))) < 0.02 * seen);
    CHECK(largest(metrics::oriented_band(grating(size, 32, false))) < 1e-9 * seen);
    CHECK(largest(metrics::oriented_band(noise(size, 1, 0.5f, 0.5f))) < 1e-9);
    CHECK(metrics::oriented_band(noise({1, 1}, 1)).size == Size{1, 1});
    CHECK_THROWS_AS(metrics::oriented_band({{2, 1}, 1, {0, 0}}), clarus::Error);
}

TEST_CASE("STRRED's entropies agree with their definition") {
    for (const Size size : {Size{160, 160}, Size{211, 137}}) {
        const Band band = metrics::oriented_band(noise(size, 2));
        const metrics::BlockEntropies blocks = metrics::block_entropies(band), expected = plain_entropies(band);
        REQUIRE(blocks.entropies.size() == static_cast<size_t>(band.size.width / 3) * (band.size.height / 3));
        for (size_t i = 0; i < blocks.entropies.size(); ++i) {
            CHECK(blocks.entropies[i] == doctest::Approx(expected.entropies[i]).epsilon(1e-7));
            CHECK(blocks.weights[i] == doctest::Approx(expected.weights[i]).epsilon(1e-7));
        }
    }
}

TEST_CASE("STRRED of nothing to see") {
    const metrics::BlockEntropies flat =
        metrics::block_entropies({{9, 9}, std::vector<double>(81, 3)});  // nine blocks, all alike
    REQUIRE(flat.entropies.size() == 9);
    for (size_t i = 0; i < 9; ++i) {
        CHECK(flat.entropies[i] == doctest::Approx(4.5 * std::log2(2 * std::numbers::pi * std::numbers::e * 0.1)));
        CHECK(flat.weights[i] == 0);
    }
    CHECK(metrics::block_entropies({{9, 8}, std::vector<double>(72, 3)}).entropies.empty());
    CHECK_FALSE(metrics::entropic_difference({}, {}));
    CHECK_THROWS_AS(metrics::entropic_difference({1}, {1, 2}), clarus::Error);
    const StrredFrame small = metrics::strred_frame(noise({40, 30}, 1), nullptr);
    CHECK(small.spatial.empty());
    CHECK_THROWS_AS(metrics::strred_frame(noise({80, 30}, 1), &small), clarus::Error);
}

TEST_CASE("STRRED grows with what is wrong, in space and in time") {
    const Size size{320, 240};
    const Pixels first = noise(size, 3), second = noise(size, 4), other = noise(size, 5);
    CHECK(spatial_difference(first, first) == 0);
    CHECK(spatial_difference(first, other) == doctest::Approx(spatial_difference(other, first)).epsilon(1e-12));
    const double little = spatial_difference(mixed(first, other, 0.1f), first);
    CHECK(little > 0);
    CHECK(spatial_difference(mixed(first, other, 0.5f), first) > little);

    const auto temporal = [](const Pixels& before, const Pixels& after) {
        const StrredFrame previous = metrics::strred_frame(before, nullptr);
        CHECK(previous.temporal.empty());
        return metrics::strred_frame(after, &previous).temporal;
    };
    const auto difference = [&](const Pixels& before, const Pixels& after) {
        return *metrics::entropic_difference(temporal(before, after), temporal(first, second));
    };
    CHECK(difference(first, second) == 0);
    CHECK(difference(first, mixed(second, other, 0.1f)) > 0);
    // A frame that is shown again changes nothing, and has no weight.
    CHECK(std::ranges::all_of(temporal(first, first), [](double value) { return value == 0; }));
    CHECK(difference(first, first) > difference(first, mixed(second, other, 0.1f)));
}
