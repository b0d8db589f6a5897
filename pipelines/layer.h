#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "graph/graph.h"
#include "io/safetensors.h"

namespace clarus::pipelines {

constexpr int64_t kAny = -1;

/// An extent that the model chooses. Errors: file, naming the tensor, where it is not from 1 to 4096.
int chosen_extent(const io::Safetensors& model, const std::string& tensor, int64_t extent);

/// A tensor's values. Errors: file, naming the tensor, where one is not finite.
std::vector<float> finite_floats(const io::Safetensors& model, const io::Tensor& tensor);

/// Whether the model has the layer's weights in whole numbers (docs/quantization.md, "Model files").
bool is_quantized(const io::Safetensors& model, const std::string& name);

/// Reads `name`.weight and `name`.bias as the weights and biases of a convolution whose shape `parameters` say; what
/// else belongs to it, too, where it is in whole numbers. Their shape begins with a number of sets where that is so of
/// the layer (`has_sets`). Errors: file, naming the tensor that is missing, has another shape or cannot be computed
/// with.
void read_weights(const io::Safetensors& model, const std::string& name, graph::Parameters& parameters,
                  bool has_sets = false);

/// The layer `name`.weight and `name`.bias, of as many output channels as told or, for kAny, as it has. Errors: file,
/// naming the tensor that is missing, has another shape or holds what is not finite.
graph::Parameters read_layer(const io::Safetensors& model, const std::string& name, int64_t out, int in,
                             int kernel = 3);

/// Refuses a quantized model whose layers' scales are too far apart. Errors: file, naming the layer.
void check_requantization(const io::Safetensors& model, const graph::Graph& graph);

}  // namespace clarus::pipelines
