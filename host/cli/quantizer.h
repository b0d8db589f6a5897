#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "clarus/types.h"
#include "cli/compensated_rounding.h"
#include "graph/graph.h"

namespace clarus::cli {

/// Some of what a layer reads, of frames that it is to be good at.
class LayerSamples {
  public:
    LayerSamples(int channels, int kernel) : channels_(channels), kernel_(kernel) {}

    /// About so many pixels, and the surroundings of about so many that the kernel covers, spread over the image
    /// [height][width][channels].
    void add(const std::vector<float>& image, Size size, size_t pixels, size_t patches);

    int channels() const { return channels_; }
    const std::vector<float>& values() const { return values_; }  // [pixels][channels], finite
    /// [patches][channels][kernel][kernel], finite, 0 outside of the image.
    const std::vector<float>& patches() const { return patches_; }

  private:
    int channels_, kernel_;
    std::vector<float> values_, patches_;
};

/// Numbers for values from the smallest sample to the largest, or so many per cent of the samples (from 50 to 100)
/// without as many of either end. 0 has a number.
graph::Quantization quantization_of(const LayerSamples& samples, double percent);

/// Of these percentages' numbers, those that the samples' rounding to changes them least by, in the mean square.
graph::Quantization closest_quantization(const LayerSamples& samples, std::span<const double> percentages);

/// A layer's float weights as whole numbers (docs/quantization.md), each output channel's scale chosen so that its
/// results of the samples change least; rounded by CompensatedRounding, which takes most of the time and is prepared
/// once. Biases make up for what the mean result changes by.
class WeightQuantizer {
  public:
    /// Both outlive it.
    WeightQuantizer(const graph::Parameters& layer, const LayerSamples& samples);

    /// For an input that is rounded so.
    graph::QuantizedWeights weights(const graph::Quantization& input) const;

  private:
    const graph::Parameters& layer_;
    const LayerSamples& samples_;
    std::vector<CompensatedRounding> roundings_;  // of each group of channels
};

}  // namespace clarus::cli
