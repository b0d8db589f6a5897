#include "pipelines/layer.h"

#include <array>

#include "base/error.h"

namespace clarus::pipelines {

int chosen_extent(const io::Safetensors& model, const std::string& tensor, int64_t extent) {
    constexpr int64_t kLargest = 1 << 12;
    if (extent < 1 || extent > kLargest)
        fail(ErrorKind::file, "{}: tensor {} has an extent of {}; from 1 to {} are possible", model.path().string(),
             tensor, extent, kLargest);
    return static_cast<int>(extent);
}

graph::Parameters read_layer(const io::Safetensors& model, const std::string& name, int64_t out, int in) {
    const std::string weight_name = name + ".weight";
    const io::Tensor& weight = model.require(weight_name, std::array<int64_t, 4>{out, in, 3, 3});
    graph::Parameters parameters{chosen_extent(model, weight_name, weight.shape[0]), in};
    parameters.weights = weight.floats();
    parameters.biases = model.require(name + ".bias", std::array<int64_t, 1>{parameters.out_channels}).floats();
    return parameters;
}

}  // namespace clarus::pipelines
