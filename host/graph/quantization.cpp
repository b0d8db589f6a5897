#include "graph/quantization.h"

#include <cmath>
#include <cstdlib>
#include <span>

namespace clarus::graph {
namespace {

std::span<const std::int8_t> weights_of(const QuantizedWeights& weights, size_t channel) {
    const size_t count = weights.weights.size() / weights.scales.size();
    return std::span(weights.weights).subspan(channel * count, count);
}

}  // namespace

Requantization requantization(double factor) {
    constexpr int kFraction = 31, kSmallest = 1, kLargest = 30;
    int exponent = 0;
    const double fraction = std::frexp(factor, &exponent);  // from a half to one
    Requantization result;
    result.shift = kFraction - exponent - 32;
    auto multiplier = std::llround(std::ldexp(fraction, kFraction));
    if (multiplier == std::int64_t{1} << kFraction) {
        multiplier /= 2;
        --result.shift;
    }
    if (factor == 0 || result.shift > kLargest) {
        multiplier = std::llround(std::ldexp(factor, 32 + kLargest));
        result.shift = kLargest;
    } else if (result.shift < kSmallest) {  // rounded up to kMostRequantized
        multiplier = (std::int64_t{1} << kFraction) - 1;
        result.shift = kSmallest;
    }
    result.multiplier = static_cast<std::int32_t>(multiplier);
    return result;
}

double requantization_factor(const QuantizedWeights& weights, size_t channel, const Quantization& result) {
    return static_cast<double>(weights.input.scale) * weights.scales[channel] / result.scale;
}

std::int32_t centred_bias(const QuantizedWeights& weights, size_t channel) {
    std::int32_t sum = 0;
    for (const std::int8_t weight : weights_of(weights, channel)) sum += weight;
    return weights.biases[channel] - weights.input.zero_point * sum;
}

double largest_sum(const QuantizedWeights& weights, size_t channel) {
    constexpr double kLargestNumber = 255;
    double sum = 0;
    for (const std::int8_t weight : weights_of(weights, channel)) sum += std::abs(weight);
    return kLargestNumber * sum;
}

}  // namespace clarus::graph
