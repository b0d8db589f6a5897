#pragma once

#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace clarus::measure {

constexpr double kConfidence = 0.95;    // of intervals
constexpr double kSteadyWithin = 0.02;  // the largest relative interval that counts as steady

/// The least value that at least `share` (0…1] of them do not exceed. `values` is not empty.
double quantile(std::span<const double> values, double share);

/// The middle value, or the mean of the middle two. `values` is not empty.
double median(std::span<const double> values);

/// Which of n sorted values, counted from 0, bound the median with at least kConfidence, by the binomial distribution
/// of how many of them lie below it. None where n is below 6: then not even the extremes do.
std::optional<std::pair<int, int>> median_ranks(int n);

/// The median of independent values, and an interval for it from their order alone, whatever their distribution.
struct Figure {
    double median = 0;
    double low = 0, high = 0;  // the interval; where there are too few values, their extremes
    int turns = 0;             // how many values
    bool steady = false;       // there were enough, and relative_interval() ≤ kSteadyWithin

    double relative_interval() const { return (high - low) / (2 * median); }
};
Figure summarise(std::span<const double> values);

/// b over a. Both intervals hold at once with at least 2 · kConfidence − 1, and then so does the ratio's.
struct Ratio {
    double value = 1, low = 1, high = 1;

    bool is_change() const { return low > 1 || high < 1; }  // else the difference is inside the noise
};
Ratio ratio(const Figure& a, const Figure& b);

}  // namespace clarus::measure
