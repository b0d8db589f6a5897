#include "pipelines/layer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <span>

#include "base/error.h"
#include "graph/passes.h"

namespace clarus::pipelines {

namespace {

template <typename Number>
std::vector<Number> whole_numbers(const io::Safetensors& model, const std::string& name, std::span<const int64_t> shape,
                                  io::DataType type, const char* type_name) {
    const io::Tensor& tensor = model.require(name, shape);
    if (tensor.type != type)
        fail(ErrorKind::file, "{}: tensor {} of a quantized layer must be of the type {}", model.path().string(), name,
             type_name);
    std::vector<Number> values(tensor.elements());
    if (!values.empty()) std::memcpy(values.data(), tensor.bytes.data(), tensor.bytes.size());
    return values;
}

std::vector<float> scales(const io::Safetensors& model, const std::string& name, std::span<const int64_t> shape) {
    const io::Tensor& tensor = model.require(name, shape);
    std::vector<float> values = tensor.floats();
    for (const float value : values)
        if (!std::isnormal(value) || value < 0)
            fail(ErrorKind::file, "{}: tensor {} holds the scale {}; a scale is a normal number above 0",
                 model.path().string(), name, value);
    return values;
}

/// Of a layer of these shapes.
graph::QuantizedWeights read_quantized(const io::Safetensors& model, const std::string& name,
                                       std::span<const int64_t> shape, std::span<const int64_t> channels) {
    constexpr std::array<int64_t, 1> kOne{1};
    graph::QuantizedWeights result;
    result.weights = whole_numbers<int8_t>(model, name + ".weight", shape, io::DataType::i8, "I8");
    if (std::find(result.weights.begin(), result.weights.end(), -128) != result.weights.end())
        fail(ErrorKind::file, "{}: tensor {}.weight holds -128; quantized weights are from -127 to 127",
             model.path().string(), name);
    result.biases = whole_numbers<int32_t>(model, name + ".bias", channels, io::DataType::i32, "I32");
    result.scales = scales(model, name + ".weight_scale", channels);
    result.input.scale = scales(model, name + ".input_scale", kOne).front();
    if (!std::isnormal(1 / result.input.scale))
        fail(ErrorKind::file, "{}: tensor {}.input_scale holds the scale {}, whose inverse is no number to count with",
             model.path().string(), name, result.input.scale);
    result.input.zero_point =
        whole_numbers<int32_t>(model, name + ".input_zero_point", kOne, io::DataType::i32, "I32").front();
    if (result.input.zero_point < 0 || result.input.zero_point > 255)
        fail(ErrorKind::file, "{}: tensor {}.input_zero_point holds {}; zero points are from 0 to 255",
             model.path().string(), name, result.input.zero_point);
    for (size_t channel = 0; channel < result.scales.size(); ++channel)
        if (graph::largest_sum(result, channel) + std::abs(static_cast<double>(result.biases[channel])) >
            std::numeric_limits<int32_t>::max())
            fail(ErrorKind::file, "{}: layer {} can overflow: sums for its output channel {} do not fit 32 bits",
                 model.path().string(), name, channel);
    for (size_t channel = 0; channel < result.scales.size(); ++channel)
        if (!std::isnormal(result.input.scale * result.scales[channel]))
            fail(ErrorKind::file,
                 "{}: layer {}: input_scale times weight_scale of output channel {} is {}, which is "
                 "no normal number",
                 model.path().string(), name, channel, result.input.scale * result.scales[channel]);
    return result;
}

}  // namespace

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

bool is_quantized(const io::Safetensors& model, const std::string& name) {
    const auto found = model.tensors().find(name + ".weight");
    return found != model.tensors().end() && found->second.type == io::DataType::i8;
}

void read_weights(const io::Safetensors& model, const std::string& name, graph::Parameters& parameters, bool has_sets) {
    parameters.layer = name;
    std::vector<int64_t> channels{parameters.sets, parameters.out_channels};
    if (!has_sets) channels.erase(channels.begin());
    std::vector<int64_t> shape = channels;
    for (const int extent : {parameters.in_channels / parameters.groups, parameters.kernel, parameters.kernel})
        shape.push_back(extent);
    if (is_quantized(model, name)) {
        parameters.quantized = read_quantized(model, name, shape, channels);
    } else {
        parameters.weights = finite_floats(model, model.require(name + ".weight", shape));
        parameters.biases = finite_floats(model, model.require(name + ".bias", channels));
    }
}

graph::Parameters read_layer(const io::Safetensors& model, const std::string& name, int64_t out, int in, int kernel) {
    const std::string weight_name = name + ".weight";
    const io::Tensor& weight = model.require(weight_name, std::array<int64_t, 4>{out, in, kernel, kernel});
    graph::Parameters parameters{chosen_extent(model, weight_name, weight.shape[0]), in};
    parameters.kernel = kernel;
    read_weights(model, name, parameters);
    return parameters;
}

void check_requantization(const io::Safetensors& model, const graph::Graph& graph) {
    const graph::Graph whole = graph::hand_on_bytes(graph);
    for (const graph::Node& node : whole.nodes) {
        const auto* convolution = std::get_if<graph::Convolution>(&node.op);
        if (!convolution || !convolution->result) continue;
        const graph::Parameters& parameters = *whole.parameters[convolution->parameters];
        for (size_t channel = 0; channel < parameters.quantized->scales.size(); ++channel) {
            const double factor = graph::requantization_factor(*parameters.quantized, channel, *convolution->result);
            if (factor >= graph::kMostRequantized)
                fail(ErrorKind::file,
                     "{}: layer {}: the multiplier of output channel {} overflows: input_scale times weight_scale is "
                     "{:.3g} of the next layer's input_scale, and must be below {}",
                     model.path().string(), parameters.layer, channel, factor, graph::kMostRequantized);
        }
    }
}

}  // namespace clarus::pipelines
