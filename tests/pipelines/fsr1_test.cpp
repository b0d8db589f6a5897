#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "clarus/error.h"
#include "clarus/upscaler.h"
#include "one_frame.h"
#include "operator_harness.h"
#include "test_device.h"

using namespace clarus;
using namespace clarus::test;
using runtime::Storage;

namespace {

/// A pixel's place between the texels around it.
struct Place {
    int column, row;
    double s, t;
};

Place place_of(int x, int y, double scale, Vec2 jitter) {
    const double u = (x + 0.5) / scale - 0.5 - jitter.x, v = (y + 0.5) / scale - 0.5 - jitter.y;
    return {static_cast<int>(std::floor(u)), static_cast<int>(std::floor(v)), u - std::floor(u), v - std::floor(v)};
}

/// AMD's description of EASU, step by step.
std::array<double, 3> easu(const Planes& image, const Place& place) {
    const auto texel = [&](int c, int i, int j) { return clamped(image, c, place.column + i, place.row + j); };
    const auto luma = [&](int i, int j) { return 0.5 * texel(2, i, j) + (0.5 * texel(0, i, j) + texel(1, i, j)); };
    double direction_x = 0, direction_y = 0, length = 0;
    for (const int j : {0, 1}) {
        for (const int i : {0, 1}) {
            const double weight = (i ? place.s : 1 - place.s) * (j ? place.t : 1 - place.t);
            const auto add = [&](double before, double at, double after, double& direction) {
                const double gradient = after - before;
                direction += gradient * weight;
                const double most = std::max(std::abs(after - at), std::abs(at - before));
                const double share = most == 0 ? 0 : std::clamp(std::abs(gradient) / most, 0.0, 1.0);
                length += share * share * weight;
            };
            add(luma(i - 1, j), luma(i, j), luma(i + 1, j), direction_x);
            add(luma(i, j - 1), luma(i, j), luma(i, j + 1), direction_y);
        }
    }
    double norm = direction_x * direction_x + direction_y * direction_y;
    if (norm < 1.0 / 32768) {
        norm = 1;
        direction_x = 1;
    }
    direction_x /= std::sqrt(norm);
    direction_y /= std::sqrt(norm);
    length = length * 0.5 * length * 0.5;
    const double stretch = (direction_x * direction_x + direction_y * direction_y) /
                           std::max(std::abs(direction_x), std::abs(direction_y));
    const double length_x = 1 + (stretch - 1) * length, length_y = 1 - 0.5 * length;
    const double lobe = 0.5 + ((1.0 / 4 - 0.04) - 0.5) * length, clip = 1 / lobe;

    std::array<double, 3> sum{};
    double weights = 0;
    for (const auto& [i, j] : std::initializer_list<std::pair<int, int>>{
             {0, -1}, {1, -1}, {-1, 0}, {0, 0}, {1, 0}, {2, 0}, {-1, 1}, {0, 1}, {1, 1}, {2, 1}, {0, 2}, {1, 2}}) {
        const double offset_x = i - place.s, offset_y = j - place.t;
        const double x = (offset_x * direction_x + offset_y * direction_y) * length_x;
        const double y = (offset_x * -direction_y + offset_y * direction_x) * length_y;
        const double squared = std::min(x * x + y * y, clip);
        const double base = 2.0 / 5 * squared - 1, window = lobe * squared - 1;
        const double weight = (25.0 / 16 * base * base - (25.0 / 16 - 1)) * window * window;
        for (int c = 0; c < 3; ++c) sum[c] += weight * texel(c, i, j);
        weights += weight;
    }
    for (int c = 0; c < 3; ++c) {
        const auto [least, most] = std::minmax({texel(c, 0, 0), texel(c, 1, 0), texel(c, 0, 1), texel(c, 1, 1)});
        sum[c] = std::clamp<double>(sum[c] / weights, least, most);
    }
    return sum;
}

Planes expected_easu(const Planes& image, double scale, Size size, Vec2 jitter) {
    return planes({3, size.height, size.width}, [&](int c, int x, int y) {
        return static_cast<float>(easu(image, place_of(x, y, scale, jitter))[c]);
    });
}

/// AMD's description of RCAS, its lobe times `sharpness`.
Planes expected_rcas(const Planes& image, double sharpness) {
    return planes(image.shape, [&](int channel, int x, int y) {
        const auto around = [&](int c) {
            return std::array<double, 4>{clamped(image, c, x, y - 1), clamped(image, c, x - 1, y),
                                         clamped(image, c, x + 1, y), clamped(image, c, x, y + 1)};
        };
        double lobe = -1e30;
        for (int c = 0; c < 3; ++c) {
            const auto ring = around(c);
            const double centre = image.at(c, x, y);
            const auto [least, most] = std::minmax_element(ring.begin(), ring.end());
            const double hit_min = *most == 0 ? 0 : std::min(*least, centre) / (4 * *most);
            const double hit_max = *least == 1 ? 0 : (1 - std::max(*most, centre)) / (4 * *least - 4);
            lobe = std::max(lobe, std::max(-hit_min, hit_max));
        }
        lobe = std::max(-(0.25 - 1.0 / 16), std::min(lobe, 0.0)) * sharpness;
        double sum = image.at(channel, x, y);
        for (const double neighbour : around(channel)) sum += lobe * neighbour;
        return static_cast<float>(std::clamp(sum / (4 * lobe + 1), 0.0, 1.0));
    });
}

/// Edges of every kind: noise, flat parts, steps, and values at either end.
Planes test_image(graph::Shape shape, std::mt19937& random) {
    Planes image = random_planes(shape, random);
    for (int c = 0; c < shape.channels; ++c) {
        for (int y = 0; y < shape.height; ++y) {
            for (int x = 0; x < shape.width; ++x) {
                if (x % 16 > 8) image.at(c, x, y) = (x + 2 * y) % 12 > 5 ? 1.0f : 0.0f;
                if (x % 32 > 24) image.at(c, x, y) = 0.25f * c;
            }
        }
    }
    return image;
}

void check_easu(graph::Shape in, double scale, Storage storage) {
    CAPTURE(scale);
    std::mt19937 random(3);
    const Planes image = rounded(test_image(in, random), storage);
    const Size size{static_cast<int>(std::lround(in.width * scale)), static_cast<int>(std::lround(in.height * scale))};
    runtime::FrameConstants frame;
    frame.jitter_x = -0.4375f;
    frame.jitter_y = 0.28125f;
    const Planes expected = expected_easu(image, scale, size, {frame.jitter_x, frame.jitter_y});
    runtime::Problem problem;
    problem.node = {graph::Easu{scale}, {}, expected.shape, "easu"};
    problem.inputs = {part_layout(in, storage, 1, 4, 0)};
    problem.output = part_layout(expected.shape, storage, 1, 4, 0);
    // Where the gradient nearly vanishes, its direction is the quotient of two roundings.
    check_operator(problem, {image}, frame, expected, 20 * storage_tolerance(storage));
}

void check_rcas(graph::Shape shape, float sharpness, Storage storage) {
    CAPTURE(sharpness);
    std::mt19937 random(3);
    const Planes image = rounded(test_image(shape, random), storage);
    const Planes expected = expected_rcas(image, sharpness);
    runtime::Problem problem;
    problem.node = {graph::Rcas{sharpness}, {}, expected.shape, "rcas"};
    problem.inputs = {part_layout(shape, storage, 1, 4, 0)};
    problem.output = part_layout(shape, storage, 1, 4, 0);
    check_operator(problem, {image}, {}, expected, sharpness == 0 ? 0 : 2 * storage_tolerance(storage));
    problem.inputs = {part_layout(shape, storage, 1, 7, 3)};
    problem.output = part_layout(shape, storage, 2, 20, 5);
    check_operator(problem, {image}, {}, expected, sharpness == 0 ? 0 : 2 * storage_tolerance(storage));
}

}  // namespace

TEST_CASE("EASU is what AMD describes") {
    check_together([&] {
        for (const Storage storage : {Storage::f32, Storage::f16}) {
            check_easu({3, 27, 75}, 2, storage);
            check_easu({3, 22, 50}, 1.5, storage);
        }
        check_easu({3, 9, 700}, 1.7, Storage::f32);
        check_easu({3, 14, 33}, 1, Storage::f32);
        check_easu({3, 5, 700}, 1.01, Storage::f32);
        check_easu({3, 6, 150}, 3, Storage::f32);
        check_easu({3, 8, 35}, 6, Storage::f32);
        check_easu({3, 3, 11}, 23.7, Storage::f32);
    });
}

TEST_CASE("RCAS is what AMD describes, and at 0 changes nothing") {
    check_together([&] {
        for (const Storage storage : {Storage::f32, Storage::f16})
            for (const float sharpness : {0.0f, 0.5f, 1.0f}) check_rcas({3, 33, 70}, sharpness, storage);
    });
}

TEST_SUITE("small") {
    TEST_CASE("FSR 1 of small images") {
        check_together([&] {
            check_easu({3, 1, 1}, 2, Storage::f32);
            check_easu({3, 3, 5}, 1.3, Storage::f32);
            check_rcas({3, 1, 1}, 1, Storage::f32);
            check_rcas({3, 5, 3}, 0.87f, Storage::f16);
        });
    }
}

TEST_CASE("EASU keeps a constant, and stays in the range of its nearest four texels") {
    const Size render{37, 21};
    const Vec2 jitter{0.2f, -0.4f};
    std::mt19937 random(12);
    for (const bool constant : {true, false}) {
        const Planes image = constant ? planes({3, 21, 37}, [](int c, int, int) { return 0.3f + 0.2f * c; })
                                      : test_image({3, 21, 37}, random);
        std::vector<float> color;
        for (int y = 0; y < render.height; ++y)
            for (int x = 0; x < render.width; ++x)
                for (int c = 0; c < 3; ++c) color.push_back(image.at(c, x, y));
        for (const double scale : {1.0, 1.5, 2.0, 3.0}) {
            UpscalerOptions options;
            options.views = {"upsampled"};
            Upscaler upscaler(test_device(), Model::filter("fsr1", scale), render, options);
            const Size size = upscaler.output_size();
            const std::vector<float> output = upscaled(upscaler, color, jitter);
            const std::vector<float> upsampled = upscaler.view("upsampled").pixels;
            size_t outside = 0;
            for (int y = 0; y < size.height; ++y) {
                for (int x = 0; x < size.width; ++x) {
                    const Place place = place_of(x, y, scale, jitter);
                    for (int c = 0; c < 3; ++c) {
                        const auto texel = [&](int i, int j) {
                            return clamped(image, c, place.column + i, place.row + j);
                        };
                        const auto [least, most] = std::minmax({texel(0, 0), texel(1, 0), texel(0, 1), texel(1, 1)});
                        const size_t element = 3 * (static_cast<size_t>(y) * size.width + x) + c;
                        outside += !(upsampled[element] >= least && upsampled[element] <= most);
                        outside += !(output[element] >= 0 && output[element] <= 1);
                        if (constant) outside += std::abs(output[element] - least) > 1e-6f;
                    }
                }
            }
            CHECK(outside == 0);
        }
    }
}

TEST_CASE("only fsr1 and fsr2 take a sharpness, from 0 to 1" * doctest::test_suite("small")) {
    UpscalerOptions options;
    options.pipeline_options["sharpness"] = 0.5;
    CHECK_NOTHROW(Upscaler(test_device(), Model::filter("fsr1", 2), {8, 8}, options));
    CHECK_THROWS_WITH_AS(Upscaler(test_device(), Model::filter("bicubic", 2), {8, 8}, options),
                         "bicubic has no option sharpness; it has: none", Error);
    for (const double wrong : {-0.1, 1.1, std::nan("")}) {
        options.pipeline_options["sharpness"] = wrong;
        CHECK_THROWS_WITH_AS(Upscaler(test_device(), Model::filter("fsr1", 2), {8, 8}, options),
                             doctest::Contains("of fsr1 it must be from 0 to 1"), Error);
    }
    options.pipeline_options = {{"sharpnes", 0.5}};
    CHECK_THROWS_WITH_AS(Upscaler(test_device(), Model::filter("fsr2", 2), {8, 8}, options),
                         doctest::Contains("no option sharpnes; it has: sharpness"), Error);
}
