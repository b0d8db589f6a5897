#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace clarus::graph {

// docs/quantization.md, "Arithmetic".

/// What the numbers of a value stand for that is stored in a byte an element: scale · (number − zero_point).
struct Quantization {
    float scale = 1;     // finite, above 0
    int zero_point = 0;  // from 0 to 255
    friend bool operator==(const Quantization&, const Quantization&) = default;
};

/// A convolution's weights in whole numbers, in the order of Parameters' own.
struct QuantizedWeights {
    Quantization input;                     // of what it reads
    std::vector<std::int8_t> weights = {};  // [sets][out][in / groups][kernel][kernel], from −127 to 127
    std::vector<float> scales = {};         // [sets][out]: a weight stands for scale · weight
    std::vector<std::int32_t> biases = {};  // [sets][out], in units of input.scale · scale
};

/// A real factor as multiplier · 2^−(32 + shift), by which sums become numbers of another scale.
struct Requantization {
    std::int32_t multiplier = 0;
    int shift = 1;  // from 1 to 30
};

/// Factors below this can be requantizations; those that are too small become 0.
inline constexpr double kMostRequantized = 0.25;
Requantization requantization(double factor);

/// What a sum of products stands for becomes numbers of `result`: by this factor.
double requantization_factor(const QuantizedWeights& weights, size_t channel, const Quantization& result);

/// A set's bias less what the input's zero point adds to sums of products, for output channel `channel` of
/// [sets][out].
std::int32_t centred_bias(const QuantizedWeights& weights, size_t channel);

/// The most that a sum of products for output channel `channel` of [sets][out] can be, whatever is read and in whatever
/// order it is added up.
double largest_sum(const QuantizedWeights& weights, size_t channel);

}  // namespace clarus::graph
