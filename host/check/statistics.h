#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace clarus::check {

constexpr double least_of_edges = 0.3;  // dB, to be sure whose depth it is

/// How much better one answer fits than another, in decibels a pair of frames.
struct Advantage {
    double gain = 0;                // the mean
    double t = 0;                   // the mean over its standard error
    size_t agree = 0, count = 0;    // of these pairs, those where it is above 0
    std::vector<size_t> against{};  // the others of `count`, by their place among the errors

    /// Sure: of three pairs in four, three pairs at least, and `least` dB on average; that mean five standard errors
    /// above nothing, since pairs of one film are not independent and the best of hundreds of answers is looked at.
    /// Where the mean is twice `least`, half as many do: then it varies because frames do, not by chance.
    bool is_sure(double least) const {
        return count >= 3 && 4 * agree >= 3 * count && gain >= least && t >= (gain >= 2 * least ? 2.5 : 5);
    }
};

/// Of errors, the smaller the better: `better` over `worse`, where both are there.
inline Advantage advantage(const std::vector<float>& better, const std::vector<float>& worse) {
    std::vector<double> gains;
    Advantage result;
    for (size_t i = 0; i < std::min(better.size(), worse.size()); ++i) {
        const double gain = 20 * std::log10(double{worse[i]} / double{better[i]});
        if (!std::isfinite(gain)) continue;
        gains.push_back(gain);
        if (!(gain > 0)) result.against.push_back(i);
    }
    result.count = gains.size();
    if (gains.empty()) return result;
    result.agree = result.count - result.against.size();
    for (const double gain : gains) result.gain += gain / static_cast<double>(gains.size());
    double square = 0;
    for (const double gain : gains) square += (gain - result.gain) * (gain - result.gain);
    const auto count = static_cast<double>(gains.size());
    constexpr double least_deviation = 0.02;  // dB: that of few pairs may be small by chance
    const double deviation = std::max(std::sqrt(square / std::max(1.0, count - 1)), least_deviation);
    result.t = result.gain / (deviation / std::sqrt(count));
    return result;
}

}  // namespace clarus::check
