#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <tuple>
#include <vector>

#include "operator_harness.h"

// The operators of docs/nss.md, pixel by pixel in double precision.

using namespace clarus;
using namespace clarus::test;
using runtime::Storage;

namespace {

using Vector = std::array<double, 2>;
using Color = std::array<double, 3>;

constexpr double kDisoccluded = 0.01, kLeast = 1e-7;

runtime::Problem problem_of(graph::Operator op, const std::vector<Planes>& inputs, const std::vector<Storage>& storages,
                            graph::Shape output, Storage storage) {
    runtime::Problem problem;
    problem.node = {std::move(op), {}, output, "nss"};
    for (size_t i = 0; i < inputs.size(); ++i) {
        const graph::Shape& shape = inputs[i].shape;
        problem.inputs.push_back(part_layout(shape, storages[i], 1, shape.channels + 1, 1));
    }
    problem.output = part_layout(output, storage, 1, output.channels + 2, 0);
    return problem;
}

bool valid(const Vector& v) { return std::isfinite(v[0]) && std::isfinite(v[1]); }
Vector still(const Vector& v) { return std::hypot(v[0], v[1]) > 0.1 ? v : Vector{0, 0}; }

double bilinear(const Planes& image, int c, double u, double v, bool clamped) {
    const int left = static_cast<int>(std::floor(u)), top = static_cast<int>(std::floor(v));
    double sum = 0;
    for (int y = top; y < top + 2; ++y) {
        for (int x = left; x < left + 2; ++x) {
            const bool inside = x >= 0 && x < image.shape.width && y >= 0 && y < image.shape.height;
            if (!inside && !clamped) continue;
            sum += (1 - std::abs(u - x)) * (1 - std::abs(v - y)) *
                   image.at(c, std::clamp(x, 0, image.shape.width - 1), std::clamp(y, 0, image.shape.height - 1));
        }
    }
    return sum;
}

Color karis(Color x) {
    for (double& value : x) value = std::max(value, 0.0);
    const double peak = *std::max_element(x.begin(), x.end());
    for (double& value : x) value /= 1 + peak;
    return x;
}

/// Depth of few levels, and motion of all kinds.
struct Scene {
    explicit Scene(Size size, unsigned seed = 5) {
        std::mt19937 random(seed);
        depth = random_planes({1, size.height, size.width}, random);
        for (float& d : depth.values) d = std::floor(d * 6) / 7 + 0.05f;
        motion = random_planes({2, size.height, size.width}, random, -3, 3);
        for (size_t i = 0; i < motion.values.size(); i += 5) motion.values[i] *= 0.01f;
        for (size_t i = 3; i < motion.values.size(); i += 17) motion.values[i] = NAN;
        for (size_t i = 8; i < motion.values.size(); i += 29) motion.values[i] = 1e6f;
    }
    Planes depth, motion;

    Vector vector(int x, int y) const { return {-motion.at(0, x, y), -motion.at(1, x, y)}; }
};

template <typename Visit>
void visit_corners(double u, double v, Visit&& visit) {
    const double left = std::floor(u), top = std::floor(v);
    for (int i = 0; i < 4; ++i) {
        const double x = left + i % 2, y = top + i / 2;
        visit(x, y, (1 - std::abs(u - x)) * (1 - std::abs(v - y)));
    }
}

bool is_inside(const graph::Shape& shape, double x, double y) {
    return x >= 0 && y >= 0 && x < shape.width && y < shape.height;
}

Planes scattered(const Scene& scene) {
    const graph::Shape& in = scene.depth.shape;
    Planes result = planes({1, std::max(1, in.height / 2), std::max(1, in.width / 2)}, [](int, int, int) { return 1; });
    const graph::Shape& out = result.shape;
    for (int j = 0; j < out.height; ++j) {
        for (int i = 0; i < out.width; ++i) {
            const int left = ((2 * i + 1) * in.width - out.width) / (2 * out.width);
            const int top = ((2 * j + 1) * in.height - out.height) / (2 * out.height);
            float nearest = INFINITY;
            Vector v{};
            for (int k = 0; k < 4; ++k) {
                const int x = std::min(left + k % 2, in.width - 1), y = std::min(top + k / 2, in.height - 1);
                if (scene.depth.at(0, x, y) > nearest) continue;
                nearest = scene.depth.at(0, x, y);
                v = scene.vector(x, y);
            }
            if (!valid(v)) continue;
            v = still({v[0] * out.width / in.width, v[1] * out.height / in.height});
            visit_corners(i - v[0], j - v[1], [&](double x, double y, double weight) {
                if (weight <= 0.1 || !is_inside(out, x, y)) return;
                float& before = result.at(0, static_cast<int>(x), static_cast<int>(y));
                before = std::min(before, nearest);
            });
        }
    }
    return result;
}

/// (row, column), as the document lists them.
constexpr int kAround[16][2] = {{0, 0},  {1, 0},  {0, 1}, {0, -1}, {-1, 0}, {-1, 1}, {1, 1}, {-1, -1},
                                {1, -1}, {-1, 2}, {0, 2}, {1, 2},  {2, 2},  {2, 1},  {2, 0}, {2, -1}};

Planes guided(const Scene& scene, const Planes& before, bool reset) {
    const graph::Shape& in = scene.depth.shape;
    const double tangent = std::tan(std::acos(-1) / 6), aspect = static_cast<double>(in.width) / in.height;
    const double middle_y = 2.0 * (in.height / 2) / in.height - 1, middle_x = 2.0 * (in.width / 2) / in.width - 1;
    const double field =
        std::hypot(1, tangent * aspect, tangent) / std::hypot(1, tangent * aspect * middle_y, tangent * middle_x);
    const double diagonal = std::hypot(in.height, in.width), tolerance = 1.37e-5 * field * diagonal;
    const double exponent = 1 + 2 * std::min(1.0, diagonal / std::hypot(1080, 1920));
    Planes result{{3, in.height, in.width}, std::vector<float>(3 * in.elements())};
    for (int y = 0; y < in.height; ++y) {
        for (int x = 0; x < in.width; ++x) {
            double nearest = scene.depth.at(0, x, y);
            Vector v = scene.vector(x, y);
            for (const auto& [row, column] : kAround) {
                if (!is_inside(in, x + column, y + row) || scene.depth.at(0, x + column, y + row) >= nearest) continue;
                nearest = scene.depth.at(0, x + column, y + row);
                v = scene.vector(x + column, y + row);
            }
            double mask = 1;
            if (reset || !valid(v)) {
                v = {NAN, NAN};
            } else {
                double kept = 0, weights = 0;
                visit_corners(
                    x / 2 - still(v)[0] * before.shape.width / in.width,
                    y / 2 - still(v)[1] * before.shape.height / in.height, [&](double u, double w, double weight) {
                        if (!is_inside(before.shape, u, w)) {
                            weights += weight;
                            return;
                        }
                        const double then = before.at(0, static_cast<int>(u), static_cast<int>(w));
                        if (weight <= 0.1 || then >= nearest) return;
                        weights += weight;
                        kept += weight * std::pow(std::min(1.0, tolerance * nearest / (nearest - then)), exponent);
                    });
                mask = weights > 0 ? std::clamp(1 - kept / weights, 0.0, 1.0) : 0;
            }
            result.at(0, x, y) = static_cast<float>(v[0]);
            result.at(1, x, y) = static_cast<float>(v[1]);
            result.at(2, x, y) = static_cast<float>(mask);
        }
    }
    return result;
}

void check_guide(Size size) {
    CAPTURE(size.width);
    const Scene scene(size);
    const Planes before = scattered(scene);
    const Planes far = planes(before.shape, [](int, int, int) { return 1.0f; });
    const std::vector<Storage> floats(3, Storage::f32);
    check_operator(problem_of(graph::NssFar{}, {scene.depth}, floats, far.shape, Storage::f32), {scene.depth}, {}, far,
                   0);
    for (const bool reset : {false, true}) {
        runtime::FrameConstants frame;
        frame.reset = reset;
        runtime::Problem scatter =
            problem_of(graph::NssScatter{}, {far, scene.depth, scene.motion}, floats, far.shape, Storage::f32);
        scatter.output = scatter.inputs[0];
        check_operator(scatter, {far, scene.depth, scene.motion}, frame, reset ? far : before, 0);
        check_operator(problem_of(graph::NssGuide{}, {scene.depth, scene.motion, before}, floats,
                                  {3, size.height, size.width}, Storage::f32),
                       {scene.depth, scene.motion, before}, frame, guided(scene, before, reset), 1e-4f);
    }
}

/// A guide with vectors of all kinds, some invalid, and a mask on both sides of what counts.
Planes random_guide(graph::Shape shape, std::mt19937& random) {
    Planes guide = random_planes({3, shape.height, shape.width}, random, -4, 4);
    for (int y = 0; y < shape.height; ++y) {
        for (int x = 0; x < shape.width; ++x) {
            const int kind = (y * shape.width + x) % 7;
            for (int c = 0; c < 2; ++c) {
                if (kind == 1) guide.at(c, x, y) *= 0.01f;
                if (kind == 2) guide.at(c, x, y) = NAN;
                if (kind == 3) guide.at(c, x, y) *= 1000;
            }
            guide.at(2, x, y) = kind % 2 == 0 ? 0.005f : 0.02f;
        }
    }
    return guide;
}

Vector guide_vector(const Planes& guide, int x, int y) { return {guide.at(0, x, y), guide.at(1, x, y)}; }

double ramp(double x, double low, double high) { return std::clamp((x - low) / (high - low), 0.0, 1.0); }

Color lifted(const Planes& color, int x, int y) {
    x = std::clamp(x, 0, color.shape.width - 1);
    y = std::clamp(y, 0, color.shape.height - 1);
    Color root;
    for (int c = 0; c < 3; ++c) root[c] = std::sqrt(std::max(0.0f, color.at(c, x, y)));
    const double orange = root[0] - root[2], t = root[2] + orange / 2, green = root[1] - t;
    return {t + green / 2, orange, green};
}

double distance(const Color& a, const Color& b) {
    return std::hypot(a[0] - b[0], 1.25 * (a[1] - b[1]), 1.25 * (a[2] - b[2]));
}

Planes flickering(const Planes& color, const Planes& guide, const Planes& derivative) {
    Planes result{{5, color.shape.height, color.shape.width}, std::vector<float>(5 * color.shape.elements() / 3)};
    for (int y = 0; y < color.shape.height; ++y) {
        for (int x = 0; x < color.shape.width; ++x) {
            const Vector v = guide_vector(guide, x, y);
            std::array<double, 4> before{};
            if (valid(v))
                for (int c = 0; c < 4; ++c)
                    before[c] = bilinear(derivative, c, x - still(v)[0], y - still(v)[1], false);
            const Color here = lifted(color, x, y);
            std::array<double, 4> beside = {
                distance(here, lifted(color, x, y - 1)), distance(here, lifted(color, x, y + 1)),
                distance(here, lifted(color, x - 1, y)), distance(here, lifted(color, x + 1, y))};
            std::sort(beside.begin(), beside.end());
            const double support = (beside[0] + beside[1] + beside[2]) / 3, p = before[3];
            const double q = 0.75 * (0.7 * distance(here, {before[0], before[1], before[2]}) + 0.3 * support);
            const double recall = ramp(q, 0.065, 0.42), mean = ramp(q, 0.07, 0.23);
            const double entry = std::sqrt(recall * ramp(std::max(q - p, 0.0), 0.025, 0.16)) * mean;
            const double heat = ramp(p, 0.11, 0.21);
            const double sustain = std::pow(ramp(0.7 * p + 0.3 * q, 0.177 - 0.02 * heat, 0.33 - 0.025 * heat), 2);
            const double carry = std::max(sustain, 0.12 * std::pow(ramp(p, 0.18, 0.28), 2));
            const double aim = std::max(entry, 0.8 * p * carry);
            double f = p + (aim - p) * (aim > p ? 0.08 + 0.14 * std::sqrt(recall * mean)
                                                : 0.24 - 0.19 * std::max(sustain, heat * heat / 2));
            double shown = p + (f - p) * (f > p ? 0.75 : 0.8);
            double size = 0;
            for (const double value : before) size += std::abs(value);
            if (guide.at(2, x, y) > kDisoccluded || size < 1e-4) f = shown = 0;
            const double values[] = {here[0], here[1], here[2], f, shown};
            for (int c = 0; c < 5; ++c) result.at(c, x, y) = static_cast<float>(values[c]);
        }
    }
    return result;
}

void check_flicker(Size size, Storage storage) {
    std::mt19937 random(11);
    const graph::Shape shape{3, size.height, size.width};
    const Planes color = rounded(random_planes(shape, random, 0, 2), storage), guide = random_guide(shape, random);
    Planes derivative = random_planes({4, size.height, size.width}, random, -0.2f, 1.2f);
    for (int y = 0; y < size.height; ++y) {
        for (int x = 0; x < size.width; ++x) {
            derivative.at(3, x, y) = std::abs(derivative.at(3, x, y)) / 3;
            if (y % 4 == 3)
                for (int c = 0; c < 4; ++c) derivative.at(c, x, y) = 0;
        }
    }
    derivative = rounded(derivative, storage);
    const std::vector<Planes> inputs = {color, guide, derivative};
    check_operator(problem_of(graph::NssFlicker{}, inputs, {storage, Storage::f32, storage},
                              {5, size.height, size.width}, storage),
                   inputs, {}, flickering(color, guide, derivative), storage == Storage::f16 ? 2e-3f : 2e-4f);
}

int mirrored(int i, int size) { return i < size ? i : std::max(2 * size - 1 - i, 0); }

void check_input(Size size, Size output, Storage storage) {
    CAPTURE(size.width);
    std::mt19937 random(12);
    const graph::Shape shape{3, size.height, size.width};
    const graph::Shape padded{12, (size.height + 7) / 8 * 8, (size.width + 7) / 8 * 8};
    const Planes color = rounded(random_planes(shape, random, 0, 5), storage), guide = random_guide(shape, random),
                 flicker = rounded(random_planes({5, size.height, size.width}, random), storage),
                 history = rounded(random_planes({3, output.height, output.width}, random, 0, 5), storage),
                 temporal = rounded(random_planes({4, padded.height, padded.width}, random), storage);
    runtime::FrameConstants frame;
    frame.jitter_x = 0.34375f;
    frame.jitter_y = -0.40625f;
    Planes expected{padded, std::vector<float>(padded.elements())};
    for (int y = 0; y < padded.height; ++y) {
        for (int x = 0; x < padded.width; ++x) {
            const int i = mirrored(x, size.width), j = mirrored(y, size.height);
            const Vector v = guide_vector(guide, i, j);
            const Vector u = valid(v) ? still(v) : Vector{0, 0};
            Color warped{}, current{};
            std::array<double, 4> fed_back{};
            for (int c = 0; c < 3; ++c) {
                current[c] = bilinear(color, c, i - frame.jitter_x, j - frame.jitter_y, true);
                if (valid(v))
                    warped[c] = bilinear(history, c, (i + 0.5 - u[0]) * output.width / size.width - 0.5,
                                         (j + 0.5 - u[1]) * output.height / size.height - 0.5, false);
            }
            if (valid(v) && guide.at(2, i, j) <= kDisoccluded)
                for (int c = 0; c < 4; ++c) fed_back[c] = bilinear(temporal, c, x - u[0], y - u[1], false);
            const double a = std::hypot(1.0 / size.width, 1.0 / size.height), b = 200 * a;
            const double length = std::hypot(u[0] / size.width, u[1] / size.height);
            warped = karis(warped);
            current = karis(current);
            for (int c = 0; c < 3; ++c) {
                expected.at(c, x, y) = static_cast<float>(warped[c]);
                expected.at(3 + c, x, y) = static_cast<float>(current[c]);
            }
            expected.at(6, x, y) = static_cast<float>(std::sqrt((std::clamp(length, a, b) - a) / (b - a)));
            for (int c = 0; c < 4; ++c) expected.at(7 + c, x, y) = static_cast<float>(fed_back[c]);
            expected.at(11, x, y) = flicker.at(4, i, j);
        }
    }
    const std::vector<Planes> inputs = {color, guide, flicker, history, temporal};
    check_operator(
        problem_of(graph::NssInput{}, inputs, {storage, Storage::f32, storage, storage, storage}, padded, storage),
        inputs, frame, expected, storage == Storage::f16 ? 2e-3f : 1e-4f);
}

/// HR pixels of an axis with the LR pixel whose sample lies there, beyond the image, too.
std::map<int, int> cells_of(int low, int high, float jitter) {
    const int divisor = std::gcd(low, high), samples = low / divisor, cells = high / divisor;
    const float scale = static_cast<float>(high) / static_cast<float>(low);
    std::map<int, int> result;
    for (int period = -8; period < divisor + 8; ++period) {
        for (int r = 0; r < samples; ++r) {
            const int cell = static_cast<int>(std::floor((r + jitter + 0.5f) * scale));
            if (cell >= 0 && cell < cells) result[period * cells + cell] = period * samples + r;
        }
    }
    return result;
}

double catmull_rom(const Planes& image, int c, double u, double v, double* least, double* most) {
    struct Axis {
        double first, weights[3], places[3];
        explicit Axis(double u) : first(std::floor(u)) {
            const double f = u - first, w0 = f * f - (f * f * f + f) / 2, w1 = 1.5 * f * f * f - 2.5 * f * f + 1,
                         w3 = (f * f * f - f * f) / 2, w2 = 1 - w0 - w1 - w3;
            weights[0] = w0, weights[1] = w1 + w2, weights[2] = w3;
            places[0] = first - 1, places[1] = first + w2 / (w1 + w2), places[2] = first + 2;
        }
    };
    const Axis x(u), y(v);
    double sum = 0, total = 0;
    *least = std::numeric_limits<double>::infinity();
    *most = -*least;
    for (const auto& [i, j] : {std::pair{1, 0}, {0, 1}, {1, 1}, {2, 1}, {1, 2}}) {
        const double value = bilinear(image, c, x.places[i], y.places[j], true), weight = x.weights[i] * y.weights[j];
        sum += weight * value;
        total += weight;
        *least = std::min(*least, value);
        *most = std::max(*most, value);
    }
    return sum / total;
}

void check_resolve(Size size, Size output, Storage storage, Vec2 jitter) {
    CAPTURE(size.width);
    CAPTURE(output.width);
    std::mt19937 random(13);
    const graph::Shape shape{3, size.height, size.width}, high{3, output.height, output.width};
    const graph::Shape padded{4, (size.height + 7) / 8 * 8, (size.width + 7) / 8 * 8};
    const Planes color = rounded(random_planes(shape, random, 0, 2), storage), guide = random_guide(shape, random),
                 kernels = rounded(random_planes({36, padded.height / 4, padded.width / 4}, random), storage),
                 temporal = rounded(random_planes(padded, random), storage);
    // Spikes, so that the filter rings below 0.
    Planes history = random_planes(high, random, 0, 2);
    for (float& value : history.values) value = value > 1.6f ? value : 0.01f * value;
    history = rounded(history, storage);
    runtime::FrameConstants frame;
    frame.jitter_x = jitter.x;
    frame.jitter_y = jitter.y;
    const std::map<int, int> columns = cells_of(size.width, output.width, jitter.x),
                             rows = cells_of(size.height, output.height, jitter.y);
    const double scale_x = static_cast<double>(output.width) / size.width,
                 scale_y = static_cast<double>(output.height) / size.height;
    Planes expected{high, std::vector<float>(high.elements())};
    for (int y = 0; y < output.height; ++y) {
        for (int x = 0; x < output.width; ++x) {
            std::vector<std::tuple<int, int, int, int>> taps;  // squared distance, channel, LR pixel
            for (int dx = -2; dx < 4; ++dx)
                for (int dy = -2; dy < 4; ++dy)
                    if (columns.contains(x + dx) && rows.contains(y + dy))
                        taps.emplace_back(dx * dx + dy * dy, 6 * (dx + 2) + dy + 2,
                                          std::clamp(columns.at(x + dx), 0, size.width - 1),
                                          std::clamp(rows.at(y + dy), 0, size.height - 1));
            std::sort(taps.begin(), taps.end());
            const bool few = taps.size() < 9, own = columns.contains(x) && rows.contains(y);
            if (taps.size() > 9) taps.resize(9);
            Color mean{}, square{}, shown{};
            double total = 0;
            for (const auto& [squared, channel, i, j] : taps) {
                const double weight = std::max<double>(kernels.at(channel, i / 4, j / 4), kLeast);
                total += weight;
                for (int c = 0; c < 3; ++c) {
                    mean[c] += weight * color.at(c, i, j);
                    square[c] += weight * color.at(c, i, j) * color.at(c, i, j);
                }
            }
            total = std::max(total, kLeast);
            const int under_x = (2 * x + 1) * size.width / (2 * output.width),
                      under_y = (2 * y + 1) * size.height / (2 * output.height);
            for (int c = 0; c < 3; ++c) {
                mean[c] /= total;
                square[c] /= total;
                if (few)
                    shown[c] = color.at(c, under_x, under_y);
                else if (own)
                    shown[c] = color.at(c, std::get<2>(taps[0]), std::get<3>(taps[0]));
            }
            std::array<double, 3> parameters;
            for (int c = 0; c < 3; ++c)
                parameters[c] = bilinear(temporal, c, (x + 0.5) / scale_x - 0.5, (y + 0.5) / scale_y - 0.5, true);
            const double toward = std::pow(parameters[0], 2), away = std::pow(1 - parameters[0], 2);
            const double theta = toward / std::max(toward + away, 1e-6), alpha = 0.05 + 0.35 * parameters[1];

            const Vector v = guide_vector(guide, x * size.width / output.width, y * size.height / output.height);
            Color toned = karis(mean);
            if (valid(v)) {
                const Vector moved = still({v[0] * scale_x, v[1] * scale_y});
                const double u = x - moved[0], w = y - moved[1];
                const bool onscreen = u >= -0.5 && u <= output.width - 0.5 && w >= -0.5 && w <= output.height - 0.5;
                Color warped, least, most, rectified;
                for (int c = 0; c < 3; ++c) warped[c] = catmull_rom(history, c, u, w, &least[c], &most[c]);
                if (std::any_of(warped.begin(), warped.end(), [](double value) { return value < 0; }))
                    for (int c = 0; c < 3; ++c) warped[c] = std::clamp(warped[c], least[c], most[c]);
                for (int c = 0; c < 3; ++c) {
                    const double sigma =
                        2 * parameters[2] * std::sqrt(std::max(std::abs(square[c] - mean[c] * mean[c]), kLeast));
                    const double held = std::clamp(warped[c], mean[c] - sigma, mean[c] + sigma);
                    rectified[c] = held + (onscreen ? theta : 0) * (warped[c] - held);
                }
                toned = karis(rectified);
                if (few || own)
                    for (int c = 0; c < 3; ++c) toned[c] += alpha * (karis(shown)[c] - toned[c]);
            }
            const double peak = *std::max_element(toned.begin(), toned.end());
            for (int c = 0; c < 3; ++c) expected.at(c, x, y) = static_cast<float>(toned[c] / (1 - peak));
        }
    }
    const std::vector<Planes> inputs = {color, guide, kernels, temporal, history};
    // In half, what is stored is rounded, and so is where a weight of 10⁻⁷ begins.
    check_operator(
        problem_of(graph::NssResolve{}, inputs, {storage, Storage::f32, storage, storage, storage}, high, storage),
        inputs, frame, expected, storage == Storage::f16 ? 4e-3f : 5e-4f);
}

void check_radiance(Size size, double white, Storage storage) {
    CAPTURE(white);
    std::mt19937 random(14);
    const graph::Shape shape{3, size.height, size.width};
    Planes color = random_planes(shape, random, -0.1f, 1.05f);
    color.values[0] = NAN;
    color.values[color.values.size() / 2] = 1;
    color.values.back() = INFINITY;
    color = rounded(color, storage);
    const double fold = 1 - 1 / white, brightest = 65504.0 / 65505;
    const auto encode = [](double v) { return v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1 / 2.4) - 0.055; };
    const auto decode = [](double v) { return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4); };
    const auto peak_at = [](const Planes& image, int x, int y, auto&& of) {
        return std::max({of(image.at(0, x, y)), of(image.at(1, x, y)), of(image.at(2, x, y))});
    };
    const auto readable = [](float v) { return v > 0 ? static_cast<double>(v) : 0.0; };
    const auto light = [&](float v) { return decode(std::min(readable(v), 1.0)); };
    const Planes radiance = planes(shape, [&](int c, int x, int y) {
        const double peak = peak_at(color, x, y, light);
        return static_cast<float>(light(color.at(c, x, y)) / (1 - fold * std::min(peak, brightest)));
    });
    // One part in 10⁷ of what is left of 1 is a large part of the brightest radiance.
    check_operator(problem_of(graph::Radiance{white}, {color}, {storage}, shape, storage), {color}, {}, radiance,
                   std::isinf(white)         ? 2e-2f
                   : storage == Storage::f16 ? 2e-3f
                                             : 2e-5f);

    Planes bright = random_planes(shape, random, 0, 3);
    bright.values[0] = NAN;
    bright.values[1] = 65504;
    bright = rounded(bright, storage);
    check_operator(
        problem_of(graph::Display{white}, {bright}, {storage}, shape, storage), {bright}, {},
        planes(shape,
               [&](int c, int x, int y) {
                   const double peak = peak_at(bright, x, y, readable);
                   return static_cast<float>(encode(std::min(1.0, readable(bright.at(c, x, y)) / (1 + fold * peak))));
               }),
        storage == Storage::f16 ? 1e-3f : 1e-5f);
}

}  // namespace

TEST_CASE("NSS's guide is what its definition says") {
    check_together([&] {
        for (const Size size : {Size{37, 22}, {18, 9}, {64, 48}, {7, 1}}) check_guide(size);
    });
}

TEST_CASE("NSS's flicker is what its definition says") {
    check_together([&] {
        for (const Storage storage : {Storage::f32, Storage::f16}) check_flicker({37, 22}, storage);
    });
}

TEST_CASE("NSS's input is what its definition says") {
    check_together([&] {
        check_input({21, 13}, {42, 26}, Storage::f32);
        check_input({16, 8}, {24, 12}, Storage::f32);
        check_input({17, 9}, {29, 15}, Storage::f16);
    });
}

TEST_CASE("NSS's reconstruction is what its definition says") {
    check_together([&] {
        check_resolve({21, 13}, {42, 26}, Storage::f32, {0.34375f, -0.40625f});
        check_resolve({16, 8}, {24, 12}, Storage::f32, {-0.15625f, 0.46875f});
        check_resolve({11, 9}, {33, 27}, Storage::f32, {0.0f, 0.21875f});
        check_resolve({34, 3}, {51, 5}, Storage::f32, {0.21875f, -0.09375f});
        check_resolve({40, 3}, {120, 9}, Storage::f16, {-0.28125f, 0.15625f});
        check_resolve({17, 11}, {17, 11}, Storage::f32, {0.40625f, -0.03125f});
        check_resolve({13, 7}, {22, 12}, Storage::f16, {0.09375f, -0.34375f});
    });
}

TEST_CASE("radiance and display are each other's inverses, of what can be shown") {
    check_together([&] {
        for (const double white : {1.0, 4.0, std::numeric_limits<double>::infinity()})
            check_radiance({19, 6}, white, Storage::f32);
        check_radiance({7, 3}, 1, Storage::f16);
    });
}

TEST_SUITE("small") {
    TEST_CASE("NSS's operators on small images") {
        check_together([&] {
            check_guide({1, 1});
            check_guide({2, 3});
            check_flicker({1, 1}, Storage::f32);
            check_flicker({3, 2}, Storage::f16);
            check_input({1, 1}, {2, 2}, Storage::f32);
            check_input({3, 2}, {5, 3}, Storage::f32);
            check_resolve({1, 1}, {2, 2}, Storage::f32, {0.25f, -0.25f});
            check_resolve({3, 2}, {9, 6}, Storage::f32, {-0.21875f, 0.03125f});
            check_radiance({1, 1}, 1, Storage::f32);
        });
    }
}
