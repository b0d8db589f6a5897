#include "cli/quantizer.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

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
    std::vector<double> value, square, rounded;
};

ChannelMeans means_of(const LayerSamples& samples, const graph::Quantization& input) {
    const size_t channels = samples.channels(), pixels = samples.values().size() / channels;
    ChannelMeans means{std::vector<double>(channels), std::vector<double>(channels), std::vector<double>(channels)};
    for (size_t i = 0; i < samples.values().size(); ++i) {
        const float value = samples.values()[i];
        const size_t channel = i % channels;
        means.value[channel] += value;
        means.square[channel] += static_cast<double>(value) * value;
        means.rounded[channel] += rounded(value, input);
    }
    for (std::vector<double>* sums : {&means.value, &means.square, &means.rounded})
        for (double& sum : *sums) sum /= static_cast<double>(std::max<size_t>(pixels, 1));
    return means;
}

int whole_weight(float weight, double scale) {
    return std::clamp(static_cast<int>(std::lround(weight / scale)), -kMostWeight, kMostWeight);
}

/// An output channel's weights [in / groups][taps], and the means of what they are multiplied with.
struct Row {
    std::span<const float> weights;
    int taps;
    const ChannelMeans& means;
    size_t first_channel;  // of the group

    size_t channel(size_t index) const { return first_channel + index / taps; }

    double error(double scale) const {
        double sum = 0;
        for (size_t i = 0; i < weights.size(); ++i) {
            const double off = weights[i] - scale * whole_weight(weights[i], scale);
            sum += off * off * (means.square[channel(i)] + 1e-12);
        }
        return sum;
    }

    double best_scale() const {
        float most = 0;
        for (const float weight : weights) most = std::max(most, std::abs(weight));
        double best = static_cast<double>(most) / kMostWeight, least = error(best);
        for (double share = 0.98; share > 0.7 && most > 0; share -= 0.02) {
            const double scale = share * most / kMostWeight, off = error(scale);
            if (off >= least) continue;
            least = off;
            best = scale;
        }
        return best;
    }

    /// What the mean result is less than it should be when weights have this scale.
    double lost_mean(double scale) const {
        double sum = 0;
        for (size_t i = 0; i < weights.size(); ++i)
            sum += weights[i] * means.value[channel(i)] -
                   scale * whole_weight(weights[i], scale) * means.rounded[channel(i)];
        return sum;
    }
};

}  // namespace

void LayerSamples::add(const std::vector<float>& image, size_t pixels) {
    const size_t channels = channels_, count = image.size() / channels;
    // Not a divisor of a row's length, as far as that can be known.
    const size_t step = std::max<size_t>(1, count / std::max<size_t>(pixels, 1)) | 1;
    for (size_t pixel = step / 2; pixel < count; pixel += step)
        for (size_t channel = 0; channel < channels; ++channel) {
            const float value = image[pixel * channels + channel];
            values_.push_back(std::isfinite(value) ? value : 0);
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

graph::QuantizedWeights quantized_weights(const graph::Parameters& layer, const LayerSamples& samples,
                                          const graph::Quantization& input) {
    const ChannelMeans means = means_of(samples, input);
    const size_t group_in = layer.in_channels / layer.groups, group_out = layer.out_channels / layer.groups;
    const size_t row_length = group_in * layer.taps();
    graph::QuantizedWeights result{input};
    for (size_t channel = 0; channel < layer.biases.size(); ++channel) {
        const size_t group = channel % layer.out_channels / group_out;
        const Row row{std::span(layer.weights).subspan(channel * row_length, row_length), layer.taps(), means,
                      group * group_in};
        const double bias = layer.biases[channel];
        // A channel of zeros keeps its bias to many digits all the same.
        const double smallest = std::max(1e-6, std::abs(bias) / input.scale / (1 << 24));
        const auto scale = static_cast<float>(std::max(row.best_scale(), smallest));
        for (const float weight : row.weights)
            result.weights.push_back(static_cast<std::int8_t>(whole_weight(weight, scale)));
        result.scales.push_back(scale);
        const double unit = static_cast<double>(input.scale) * scale, most = 1 << 30;
        result.biases.push_back(
            static_cast<std::int32_t>(std::lround(std::clamp((bias + row.lost_mean(scale)) / unit, -most, most))));
    }
    return result;
}

}  // namespace clarus::cli
