#include "cli/quantizer.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

namespace clarus::cli {
namespace {

constexpr int kMostWeight = 127, kMostNumber = 255;

/// The number of a value, and back.
float rounded(float value, const graph::Quantization& quantization) {
    const float whole = std::nearbyint(value * (1 / quantization.scale)) + static_cast<float>(quantization.zero_point);
    const float number = std::clamp(whole, 0.0f, static_cast<float>(kMostNumber));
    return quantization.scale * (number - static_cast<float>(quantization.zero_point));
}

/// Of each channel of what a layer reads.
struct ChannelMeans {
    std::vector<double> value, rounded;
};

ChannelMeans means_of(const LayerSamples& samples, const graph::Quantization& input) {
    const size_t channels = samples.channels(), pixels = samples.values().size() / channels;
    ChannelMeans means{std::vector<double>(channels), std::vector<double>(channels)};
    for (size_t i = 0; i < samples.values().size(); ++i) {
        means.value[i % channels] += samples.values()[i];
        means.rounded[i % channels] += rounded(samples.values()[i], input);
    }
    for (std::vector<double>* sums : {&means.value, &means.rounded})
        for (double& sum : *sums) sum /= static_cast<double>(std::max<size_t>(pixels, 1));
    return means;
}

/// An output channel's weights in whole numbers.
struct RoundedRow {
    double scale;
    std::vector<std::int8_t> weights;
};

/// `smallest`: of scales.
RoundedRow rounded_row(std::span<const float> weights, const CompensatedRounding& rounding, double smallest) {
    float most = 0;
    for (const float weight : weights) most = std::max(most, std::abs(weight));
    RoundedRow best;
    double least = std::numeric_limits<double>::infinity();
    for (const double share : {1.0, 0.9, 0.8}) {
        const double scale = static_cast<float>(std::max(share * most / kMostWeight, smallest));
        std::vector<std::int8_t> whole = rounding.round(weights, scale, kMostWeight);
        const double error = rounding.error(weights, whole, scale);
        if (error >= least) continue;
        least = error;
        best = {scale, std::move(whole)};
    }
    return best;
}

/// Pixels apart, of so many of which so many are wanted: odd, lest all are of few columns.
size_t step_between(size_t count, size_t wanted) {
    return std::max<size_t>(1, count / std::max<size_t>(wanted, 1)) | 1;
}

float finite(float value) { return std::isfinite(value) ? value : 0; }

}  // namespace

void LayerSamples::add(const std::vector<float>& image, Size size, size_t pixels, size_t patches) {
    const size_t channels = channels_, count = image.size() / channels;
    const size_t step = step_between(count, pixels);
    for (size_t pixel = step / 2; pixel < count; pixel += step)
        for (size_t channel = 0; channel < channels; ++channel)
            values_.push_back(finite(image[pixel * channels + channel]));
    const size_t patch_step = step_between(count, patches);
    for (size_t pixel = patch_step / 2; pixel < count; pixel += patch_step) {
        const int x = static_cast<int>(pixel % size.width) - kernel_ / 2;
        const int y = static_cast<int>(pixel / size.width) - kernel_ / 2;
        for (int channel = 0; channel < channels_; ++channel)
            for (int py = y; py < y + kernel_; ++py)
                for (int px = x; px < x + kernel_; ++px) {
                    const bool inside = px >= 0 && px < size.width && py >= 0 && py < size.height;
                    const size_t at = (static_cast<size_t>(py) * size.width + px) * channels + channel;
                    patches_.push_back(inside ? finite(image[at]) : 0);
                }
    }
}

graph::Quantization quantization_of(const LayerSamples& samples, double percent) {
    std::vector<float> sorted = samples.values();
    std::sort(sorted.begin(), sorted.end());
    const auto left_out = static_cast<size_t>((1 - percent / 100) * static_cast<double>(sorted.size()));
    const float low = std::min(sorted[left_out], 0.0f), high = std::max(sorted[sorted.size() - 1 - left_out], 0.0f);
    graph::Quantization result;
    const float range = high - low;
    result.scale = (range > 1e-6f ? range : 1) / kMostNumber;
    result.zero_point = std::clamp(static_cast<int>(std::lround(-low / result.scale)), 0, kMostNumber);
    return result;
}

graph::Quantization closest_quantization(const LayerSamples& samples, std::span<const double> percentages) {
    graph::Quantization closest;
    double least = std::numeric_limits<double>::infinity();
    for (const double percent : percentages) {
        const graph::Quantization quantization = quantization_of(samples, percent);
        double sum = 0;
        for (const float value : samples.values()) {
            const double off = value - rounded(value, quantization);
            sum += off * off;
        }
        if (sum >= least) continue;
        least = sum;
        closest = quantization;
    }
    return closest;
}

WeightQuantizer::WeightQuantizer(const graph::Parameters& layer, const LayerSamples& samples)
    : layer_(layer), samples_(samples) {
    const size_t taps = layer.taps(), row_length = layer.in_channels / layer.groups * taps;
    for (int group = 0; group < layer.groups; ++group)
        roundings_.emplace_back(samples.patches(), layer.in_channels * taps, group * row_length, row_length);
}

graph::QuantizedWeights WeightQuantizer::weights(const graph::Quantization& input) const {
    const ChannelMeans means = means_of(samples_, input);
    const size_t taps = layer_.taps(), group_in = layer_.in_channels / layer_.groups;
    const size_t group_out = layer_.out_channels / layer_.groups, row_length = group_in * taps;
    graph::QuantizedWeights result{input};
    for (size_t channel = 0; channel < layer_.biases.size(); ++channel) {
        const size_t group = channel % layer_.out_channels / group_out;
        const std::span weights = std::span(layer_.weights).subspan(channel * row_length, row_length);
        const double bias = layer_.biases[channel];
        // A channel of zeros keeps its bias to many digits all the same.
        const double smallest = std::max(1e-6, std::abs(bias) / input.scale / (1 << 24));
        const RoundedRow row = rounded_row(weights, roundings_[group], smallest);
        result.weights.insert(result.weights.end(), row.weights.begin(), row.weights.end());
        result.scales.push_back(static_cast<float>(row.scale));
        double lost_mean = 0;
        for (size_t i = 0; i < row_length; ++i) {
            const size_t read = group * group_in + i / taps;
            lost_mean += weights[i] * means.value[read] - row.scale * row.weights[i] * means.rounded[read];
        }
        const double unit = static_cast<double>(input.scale) * row.scale, most = 1 << 30;
        result.biases.push_back(
            static_cast<std::int32_t>(std::lround(std::clamp((bias + lost_mean) / unit, -most, most))));
    }
    return result;
}

}  // namespace clarus::cli
