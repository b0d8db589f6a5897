#include "measure/statistics.h"

#include <algorithm>
#include <cmath>

namespace clarus::measure {
namespace {

std::vector<double> sorted(std::span<const double> values) {
    std::vector<double> result(values.begin(), values.end());
    std::sort(result.begin(), result.end());
    return result;
}

/// The chance that exactly k of n fair coins show heads.
double binomial(int n, int k) {
    return std::exp(std::lgamma(n + 1.0) - std::lgamma(k + 1.0) - std::lgamma(n - k + 1.0) - n * std::log(2.0));
}

}  // namespace

double quantile(std::span<const double> values, double share) {
    const std::vector<double> in_order = sorted(values);
    const double count = static_cast<double>(in_order.size());
    const auto rank = static_cast<size_t>(std::ceil(share * count - 1e-9));
    return in_order[std::clamp<size_t>(rank, 1, in_order.size()) - 1];
}

double median(std::span<const double> values) {
    const std::vector<double> in_order = sorted(values);
    const size_t half = in_order.size() / 2;
    return in_order.size() % 2 ? in_order[half] : (in_order[half - 1] + in_order[half]) / 2;
}

std::optional<std::pair<int, int>> median_ranks(int n) {
    // Fewer than `low` + 1 below the median, or fewer above it, is what may happen with at most this chance a side.
    const double chance = (1 - kConfidence) / 2;
    // What lies ten standard deviations below the middle has no chance that a double would add to.
    int low = std::max(0, static_cast<int>(n / 2 - 5 * std::sqrt(n))) - 1;
    double below = 0;
    while (low + 1 < n / 2) {
        below += binomial(n, low + 1);
        if (below > chance) break;
        ++low;
    }
    if (low < 0) return std::nullopt;
    return std::pair(low, n - 1 - low);
}

Figure summarise(std::span<const double> values) {
    const std::vector<double> in_order = sorted(values);
    const int count = static_cast<int>(in_order.size());
    const auto ranks = median_ranks(count);
    Figure figure;
    figure.median = median(in_order);
    figure.low = ranks ? in_order[ranks->first] : in_order.front();
    figure.high = ranks ? in_order[ranks->second] : in_order.back();
    figure.turns = count;
    figure.steady = ranks && figure.relative_interval() <= kSteadyWithin;
    return figure;
}

Ratio ratio(const Figure& a, const Figure& b) { return {b.median / a.median, b.low / a.high, b.high / a.low}; }

}  // namespace clarus::measure
