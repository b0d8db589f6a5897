#include "metrics/quality.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "clarus/error.h"
#include "metrics/display.h"
#include "metrics/psnr.h"
#include "metrics/radiance.h"
#include "metrics/ssim.h"

using clarus::Size;
using clarus::io::Pixels;
namespace metrics = clarus::metrics;
using metrics::BlockErrors;
using metrics::Mask;
using metrics::Region;

namespace {

Pixels noise(Size size, unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> distribution(0, 1);
    Pixels pixels{size, 3, std::vector<float>(static_cast<size_t>(size.width) * size.height * 3)};
    for (float& value : pixels.values) value = distribution(random);
    return pixels;
}

Mask random_mask(Size size, unsigned seed, unsigned one_in) {
    std::mt19937 random(seed);
    Mask mask(static_cast<size_t>(size.width) * size.height);
    for (uint8_t& value : mask) value = random() % one_in == 0;
    return mask;
}

double squares(const Pixels& a, const Pixels& b, int x, int y) {
    double sum = 0;
    for (int c = 0; c < 3; ++c) sum += std::pow(static_cast<double>(a.at(x, y, c)) - b.at(x, y, c), 2);
    return sum;
}

}  // namespace

TEST_CASE("the map of SSIM is SSIM, window by window") {
    const Pixels image = noise({19, 14}, 1), reference = noise({19, 14}, 2);
    const auto map = metrics::ssim_map(image, reference);
    REQUIRE(map->size == Size{9, 4});
    for (int y = 0; y < 4; ++y)
        for (int x = 0; x < 9; ++x) {
            Pixels a{{11, 11}, 3, {}}, b = a;
            for (int j = 0; j < 11; ++j)
                for (int i = 0; i < 11; ++i)
                    for (int c = 0; c < 3; ++c) {
                        a.values.push_back(image.at(x + i, y + j, c));
                        b.values.push_back(reference.at(x + i, y + j, c));
                    }
            CHECK(map->values[y * 9 + x] == doctest::Approx(*metrics::ssim(a, b)).epsilon(1e-9));
        }
    CHECK(*metrics::ssim(image, reference) == map->mean());
    CHECK_FALSE(metrics::ssim_map(noise({10, 30}, 1), noise({10, 30}, 2)));
}

TEST_CASE("quality inside a mask is that of its pixels") {
    const Size size{31, 24};
    const Pixels image = noise(size, 3), reference = noise(size, 4);
    const auto map = metrics::ssim_map(image, reference);
    for (const unsigned one_in : {1u, 2u, 7u}) {
        const Mask mask = random_mask(size, one_in, one_in);
        double error = 0, similarity = 0;
        int pixels = 0, windows = 0;
        for (int y = 0; y < size.height; ++y)
            for (int x = 0; x < size.width; ++x) {
                if (!mask[y * size.width + x]) continue;
                error += squares(image, reference, x, y);
                ++pixels;
                if (x < 5 || y < 5 || x >= size.width - 5 || y >= size.height - 5) continue;
                similarity += map->values[(y - 5) * map->size.width + x - 5];
                ++windows;
            }
        const auto quality = metrics::measure_region(image, reference, map, mask);
        REQUIRE(quality);
        CHECK(quality->psnr == doctest::Approx(-10 * std::log10(error / (3 * pixels))).epsilon(1e-9));
        CHECK(*quality->ssim == doctest::Approx(similarity / windows).epsilon(1e-9));
    }
    const metrics::FrameQuality whole = metrics::measure(image, reference);
    const auto everywhere = metrics::measure_region(image, reference, map, Mask(31 * 24, 1));
    CHECK(everywhere->psnr == doctest::Approx(whole.psnr).epsilon(1e-12));
}

TEST_CASE("a mask of fewer than 64 pixels has no figure, and one at the border no SSIM") {
    const Size size{70, 20};
    const Pixels image = noise(size, 5), reference = noise(size, 6);
    Mask mask(70 * 20);
    std::fill_n(mask.begin(), 63, 1);
    CHECK_FALSE(metrics::measure_region(image, reference, {}, mask));
    mask[63] = 1;
    const auto quality = metrics::measure_region(image, reference, metrics::ssim_map(image, reference), mask);
    REQUIRE(quality);
    CHECK_FALSE(quality->ssim);
    CHECK_FALSE(metrics::measure_region(image, reference, {}, Mask(70 * 20, 1))->ssim);
    CHECK_THROWS_AS(metrics::measure_region(image, reference, {}, Mask(70 * 19, 1)), clarus::Error);
    CHECK_THROWS_AS(metrics::measure_region(image, noise({20, 70}, 1), {}, mask), clarus::Error);
}

TEST_CASE("blocks are of 48×48 pixels, the last of them cut") {
    for (const Size size : {Size{1, 1}, Size{48, 48}, Size{49, 97}, Size{130, 50}}) {
        const Pixels image = noise(size, 7), reference = noise(size, 8);
        const BlockErrors blocks = metrics::block_errors(image, reference);
        CHECK(blocks.grid == Size{(size.width + 47) / 48, (size.height + 47) / 48});
        std::vector<double> sums(blocks.mean_squared_errors.size()), counts(sums.size());
        REQUIRE(sums.size() == static_cast<size_t>(blocks.grid.width) * blocks.grid.height);
        for (int y = 0; y < size.height; ++y)
            for (int x = 0; x < size.width; ++x) {
                const size_t block = static_cast<size_t>(y / 48) * blocks.grid.width + x / 48;
                sums[block] += squares(image, reference, x, y);
                counts[block] += 3;
            }
        for (size_t i = 0; i < sums.size(); ++i)
            CHECK(blocks.mean_squared_errors[i] == doctest::Approx(sums[i] / counts[i]).epsilon(1e-12));
    }
}

TEST_CASE("the worst hundredth of blocks is one at least") {
    std::vector<double> errors(250);
    for (size_t i = 0; i < errors.size(); ++i) errors[i] = static_cast<double>(i * 7 % 250);
    CHECK(metrics::worst_hundredth(errors) == 248);  // of 249, 248 and 247
    CHECK(metrics::worst_hundredth({3}) == 3);
    CHECK(metrics::worst_hundredth(std::vector<double>(100, 2)) == 2);
    CHECK_THROWS_AS(metrics::worst_hundredth({}), clarus::Error);
}

TEST_CASE("blocks are worse than a baseline's where their error is larger") {
    const BlockErrors baseline{{2, 2}, {1, 2, 3, 4}};
    CHECK(metrics::share_worse({{2, 2}, {1, 2.5, 2, 5}}, baseline) == 0.5);
    CHECK(metrics::share_worse(baseline, baseline) == 0);
    CHECK_THROWS_AS(metrics::share_worse({{4, 1}, {1, 2, 3, 4}}, baseline), clarus::Error);
}

TEST_CASE("a sequence's figures of places are means over the frames that have them, and of all blocks") {
    const Size size{60, 50};
    metrics::Masks masks;
    masks.masks.fill(Mask(60 * 50));
    std::vector<metrics::FrameQuality> frames, baseline;
    std::vector<double> errors;
    for (unsigned i = 0; i < 3; ++i) {
        // A tenth and more of the pixels move from the second frame on; only the last has thin ones.
        std::fill_n(masks[Region::moving].begin(), i == 0 ? 299 : 300, 1);
        if (i == 2) std::fill_n(masks[Region::thin].begin() + 1500, 100, 1);
        const Pixels reference = noise(size, 10 + i);
        frames.push_back(metrics::measure(noise(size, 20 + i), reference, &masks));
        baseline.push_back(metrics::measure(noise(size, 30 + i), reference));
        CHECK(frames.back().moves == (i > 0));
        const auto& blocks = frames.back().blocks.mean_squared_errors;
        errors.insert(errors.end(), blocks.begin(), blocks.end());
    }
    metrics::compare_blocks(frames, baseline);
    const metrics::SequenceQuality quality = metrics::summarise(frames);
    const auto& moving = quality.regions[static_cast<size_t>(Region::moving)];
    double sum = 0;
    for (const auto& frame : frames) sum += frame.regions[static_cast<size_t>(Region::moving)]->psnr;
    CHECK(moving->psnr == doctest::Approx(sum / 3));
    CHECK(quality.regions[static_cast<size_t>(Region::thin)]->psnr ==
          frames[2].regions[static_cast<size_t>(Region::thin)]->psnr);
    CHECK_FALSE(quality.regions[static_cast<size_t>(Region::still)]);
    CHECK(*quality.worst_blocks_psnr == metrics::psnr(*std::ranges::max_element(errors)));  // of 12 one
    CHECK(*quality.worse_blocks ==
          doctest::Approx((*frames[0].worse_blocks + *frames[1].worse_blocks + *frames[2].worse_blocks) / 3));
    CHECK(*quality.worse_blocks_moving == doctest::Approx((*frames[1].worse_blocks + *frames[2].worse_blocks) / 2));
    CHECK_FALSE(metrics::summarise(baseline).worse_blocks);
    CHECK_THROWS_AS(metrics::compare_blocks(frames, std::span(baseline).first(2)), clarus::Error);
}

TEST_CASE("PQ codes are those of ST 2084") {
    // The standard's way from codes to light, and three points that ITU-R BT.2408 prints, in per cent.
    for (double code = 0.02; code < 1.001; code += 0.07) {
        const double power = std::pow(code, 1 / 78.84375);
        const double nits =
            10000 * std::pow(std::max(power - 0.8359375, 0.0) / (18.8515625 - 18.6875 * power), 1 / 0.1593017578125);
        CHECK(metrics::pq_code(nits / 100) == doctest::Approx(code).epsilon(1e-6));
    }
    for (const auto& [nits, percent] : {std::pair{26.0, 38}, {203.0, 58}, {1000.0, 75}})
        CHECK(std::round(100 * metrics::pq_code(nits / 100)) == percent);
    CHECK(metrics::pq_code(1e9) == 1);
    CHECK(metrics::pq_code(0) < 1e-6);
}

TEST_CASE("figures of linear radiance") {
    const Size size{5, 3};
    Pixels reference = noise(size, 1), image = reference;
    for (float& value : reference.values) value *= 20;
    for (size_t i = 0; i < image.values.size(); ++i) image.values[i] = reference.values[i] * 0.9f;
    const metrics::RadianceQuality quality = metrics::measure_radiance(image, reference);
    double relative = 0, squares = 0;
    for (size_t i = 0; i < image.values.size(); ++i) {
        relative += 0.1 * reference.values[i] / (reference.values[i] + 0.01) / 45;
        squares += std::pow(metrics::pq_code(image.values[i]) - metrics::pq_code(reference.values[i]), 2) / 45;
    }
    CHECK(*quality.mean_ratio == doctest::Approx(0.9));
    CHECK(quality.relative_error == doctest::Approx(relative).epsilon(1e-5));
    CHECK(quality.pq_psnr == doctest::Approx(-10 * std::log10(squares)));
    CHECK(metrics::measure_radiance(reference, reference).pq_psnr == 100);
    const Pixels black{size, 3, std::vector<float>(45)};
    CHECK_FALSE(metrics::measure_radiance(image, black).mean_ratio);
    CHECK_THROWS_AS(metrics::measure_radiance(image, noise({3, 5}, 1)), clarus::Error);

    std::vector<metrics::FrameQuality> frames(2, metrics::measure(noise(size, 2), noise(size, 3)));
    frames[0].radiance = quality;
    CHECK_FALSE(metrics::summarise(frames).radiance);
    frames[1].radiance = {{}, 0.5, 20};
    const auto mean = metrics::summarise(frames).radiance;
    CHECK(*mean->mean_ratio == *quality.mean_ratio);
    CHECK(mean->relative_error == doctest::Approx((quality.relative_error + 0.5) / 2));
    CHECK(mean->pq_psnr == doctest::Approx((quality.pq_psnr + 20) / 2));
}

TEST_CASE("exposed radiance has neither negative nor endless light") {
    const float nan = std::numeric_limits<float>::quiet_NaN(), infinity = std::numeric_limits<float>::infinity();
    const Pixels image{{2, 1}, 4, {1, -2, nan, 9, infinity, 0.5f, -infinity, 9}};
    const Pixels exposed = metrics::exposed_radiance(image, 2);
    CHECK(exposed.channels == 3);
    CHECK(exposed.values == std::vector<float>{2, 0, 0, 131008, 1, 0});
    CHECK_THROWS_AS(metrics::exposed_radiance({{1, 1}, 1, {0}}, 1), clarus::Error);
}
