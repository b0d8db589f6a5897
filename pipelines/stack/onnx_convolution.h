#pragma once

#include <vector>

#include "pipelines/stack/layer_list.h"
#include "pipelines/stack/onnx_node.h"

namespace clarus::pipelines {

/// ONNX's Conv of an image of so many channels as a stack has it: square, odd, its taps around the pixel. Dilated,
/// oblong, even and off-centre kernels become larger ones with zeros. `biases` may be null; the result has at most
/// `most_weights`. Errors: file, where the image would not keep its size, but for being divided by the stride.
LayerWeights read_convolution(const OnnxNodeReader& node, const io::OnnxTensor& weights,
                              const std::vector<float>* biases, int channels, double most_weights);

struct TransposedConvolution {
    LayerWeights weights;  // [in][out / groups][size][size]
    int padding = 0;
};

/// ONNX's ConvTranspose, likewise: one that makes the image exactly as many times as large as its stride.
TransposedConvolution read_transposed_convolution(const OnnxNodeReader& node, const io::OnnxTensor& weights,
                                                  const std::vector<float>* biases, int channels);

}  // namespace clarus::pipelines
