#pragma once

#include <cstdint>
#include <string>

#include "graph/graph.h"
#include "io/safetensors.h"

namespace clarus::pipelines {

constexpr int64_t kAny = -1;

/// An extent that the model chooses. Errors: file, naming the tensor, where it is not from 1 to 4096.
int chosen_extent(const io::Safetensors& model, const std::string& tensor, int64_t extent);

/// The layer `name`.weight and `name`.bias, of as many output channels as told or, for kAny, as it has. Errors: file,
/// naming the tensor that is missing or has another shape.
graph::Parameters read_layer(const io::Safetensors& model, const std::string& name, int64_t out, int in);

}  // namespace clarus::pipelines
