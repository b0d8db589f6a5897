#include "pipelines/layer.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/error.h"

namespace clarus::pipelines {

int chosen_extent(const io::Safetensors& model, const std::string& tensor, int64_t extent) {
    constexpr int64_t kLargest = 1 << 12;
    if (extent < 1 || extent > kLargest)
        fail(ErrorKind::file, "{}: tensor {} has an extent of {}; from 1 to {} are possible", model.path().string(),
             tensor, extent, kLargest);
    return static_cast<int>(extent);
}

std::vector<float> finite_floats(const io::Safetensors& model, const io::Tensor& tensor) {
    std::vector<float> values = tensor.floats();
    if (!std::all_of(values.begin(), values.end(), [](float value) { return std::isfinite(value); }))
        fail(ErrorKind::file, "{}: tensor {} holds a value that is not finite", model.path().string(), tensor.name);
    return values;
}

graph::Parameters read_layer(const io::Safetensors& model, const std::string& name, int64_t out, int in, int kernel) {
    const std::string weight_name = name + ".weight";
    const io::Tensor& weight = model.require(weight_name, std::array<int64_t, 4>{out, in, kernel, kernel});
    graph::Parameters parameters{chosen_extent(model, weight_name, weight.shape[0]), in};
    parameters.kernel = kernel;
    parameters.weights = finite_floats(model, weight);
    parameters.biases =
        finite_floats(model, model.require(name + ".bias", std::array<int64_t, 1>{parameters.out_channels}));
    return parameters;
}

}  // namespace clarus::pipelines
