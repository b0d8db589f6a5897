#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "graph/graph.h"

namespace clarus::cli {

/// Some of the pixels that a layer reads, of frames that it is to be good at.
class LayerSamples {
  public:
    explicit LayerSamples(int channels) : channels_(channels) {}

    /// About `pixels` pixels, spread over the image [height · width][channels].
    void add(const std::vector<float>& image, size_t pixels);

    int channels() const { return channels_; }
    const std::vector<float>& values() const { return values_; }  // [pixels][channels], finite
    bool empty() const { return values_.empty(); }

  private:
    int channels_;
    std::vector<float> values_;
};

/// Numbers for values from the smallest sample to the largest, or so many per cent of the samples (from 50 to 100)
/// without as many of either end. 0 has a number.
graph::Quantization quantization_of(const LayerSamples& samples, double percent);

/// Of these percentages' numbers, those that the samples' rounding to changes them least by, in the mean square.
graph::Quantization closest_quantization(const LayerSamples& samples, std::span<const double> percentages);

/// A layer's float weights as whole numbers (docs/quantization.md), each output channel's scale chosen so that its
/// results of the samples change least. Biases make up for what the mean result changes by.
graph::QuantizedWeights quantized_weights(const graph::Parameters& layer, const LayerSamples& samples,
                                          const graph::Quantization& input);

}  // namespace clarus::cli
