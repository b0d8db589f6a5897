#include "check/jitter_in_motion.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace clarus::check {
namespace {

constexpr size_t fewest_pairs = 6;  // a parabola takes three
constexpr double sure_gain = 6;     // dB: half of what the other answer leaves
constexpr double noise = 1e-4;      // square pixels

using Series = std::vector<double>;

double product(const Series& a, const Series& b) {
    double sum = 0;
    for (size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
    return sum;
}

void remove(Series& from, const Series& unit) {
    const double share = product(from, unit);
    for (size_t i = 0; i < from.size(); ++i) from[i] -= share * unit[i];
}

/// Without constant, linear and quadratic parts.
Series without_parabola(Series values) {
    std::array<Series, 3> basis;
    for (size_t power = 0; power < basis.size(); ++power) {
        for (size_t i = 0; i < values.size(); ++i)
            basis[power].push_back(std::pow(static_cast<double>(i), static_cast<double>(power)));
        for (size_t lower = 0; lower < power; ++lower) remove(basis[power], basis[lower]);
        const double length = std::sqrt(product(basis[power], basis[power]));
        for (double& value : basis[power]) value /= length;
        remove(values, basis[power]);
    }
    return values;
}

/// What is left of `values` when `factor` times `other` is taken away.
double left(const Series& values, const Series& other, double factor) {
    double sum = noise;
    for (size_t i = 0; i < values.size(); ++i) {
        const double rest = values[i] - factor * other[i];
        sum += rest * rest;
    }
    return sum;
}

}  // namespace

JitterInMotion find_jitter_in_motion(const std::vector<Vec2>& motion, const std::vector<Vec2>& jitter) {
    Series motion_x, motion_y, jitter_x, jitter_y;
    for (size_t i = 0; i < motion.size(); ++i) {
        if (!std::isfinite(motion[i].x) || !std::isfinite(motion[i].y)) continue;
        motion_x.push_back(motion[i].x);
        motion_y.push_back(motion[i].y);
        jitter_x.push_back(jitter[i].x);
        jitter_y.push_back(jitter[i].y);
    }
    JitterInMotion result;
    result.count = motion_x.size();
    if (result.count < fewest_pairs) return result;
    for (Series* series : {&motion_x, &motion_y, &jitter_x, &jitter_y}) *series = without_parabola(std::move(*series));

    struct Answer {
        double left;
        int orientation;  // −1: absent
    };
    std::vector<Answer> answers{{left(motion_x, jitter_x, 0) + left(motion_y, jitter_y, 0), -1}};
    for (int orientation = 0; orientation < 8; ++orientation) {
        const bool swapped = (orientation & 4) != 0;
        answers.push_back({left(motion_x, swapped ? jitter_y : jitter_x, orientation & 1 ? -1 : 1) +
                               left(motion_y, swapped ? jitter_x : jitter_y, orientation & 2 ? -1 : 1),
                           orientation});
    }
    std::ranges::sort(answers, {}, &Answer::left);
    result.gain = 10 * std::log10(answers[1].left / answers[0].left);
    if (result.gain < sure_gain) return result;
    const int orientation = answers[0].orientation;
    result.is_absent = orientation < 0;
    result.is_there = orientation >= 0;
    if (result.is_there) {
        result.x_flipped = (orientation & 1) != 0;
        result.y_flipped = (orientation & 2) != 0;
        result.axes_swapped = (orientation & 4) != 0;
    }
    return result;
}

}  // namespace clarus::check
