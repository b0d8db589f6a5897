#include "pipelines/stack/layer_list.h"

#include <algorithm>
#include <utility>

#include "io/safetensors_writer.h"

namespace clarus::pipelines {
namespace {

/// A name for people that is safe wherever it is printed.
bool is_plain(const std::string& name) {
    constexpr size_t kLongest = 64;
    return !name.empty() && name.size() <= kLongest && std::ranges::all_of(name, [](unsigned char letter) {
        return (letter >= '0' && letter <= '9') || (letter >= 'a' && letter <= 'z') ||
               (letter >= 'A' && letter <= 'Z') || letter == '.' || letter == '_' || letter == '-';
    });
}

}  // namespace

void LayerList::add(LayerImage& image, nlohmann::json fields) {
    if (image.layer != last()) fields["of"] = image.layer;
    layers_.push_back(std::move(fields));
    image.layer = last();
    image.is_plain_convolution = false;
}

std::string LayerList::tensor_name(const std::string& wanted) const {
    constexpr std::string_view kEnd = ".weight";
    const std::string name = wanted.ends_with(kEnd) ? wanted.substr(0, wanted.size() - kEnd.size()) : wanted;
    if (is_plain(name) && !tensors_.contains(name + ".weight")) return name;
    return "layer " + std::to_string(layers_.size());
}

std::string LayerList::add_tensors(const std::string& wanted, std::vector<int64_t> shape, LayerWeights weights) {
    weights_ += static_cast<double>(weights.weights.size());
    std::string name = tensor_name(wanted);
    tensors_[name + ".weight"] = {std::move(shape), std::move(weights.weights)};
    if (!weights.biases.empty()) tensors_[name + ".bias"] = {{std::ssize(weights.biases)}, std::move(weights.biases)};
    return name;
}

void LayerList::convolve(LayerImage& image, LayerWeights weights, const std::string& name) {
    nlohmann::json fields{{"type", "convolution"}, {"size", weights.size}};
    if (weights.stride > 1) fields["stride"] = weights.stride;
    if (weights.groups > 1) fields["groups"] = weights.groups;
    image.channels = weights.out;
    image.shrunk *= weights.stride;
    fields["tensor"] =
        add_tensors(name, {weights.out, weights.in / weights.groups, weights.size, weights.size}, std::move(weights));
    add(image, std::move(fields));
}

void LayerList::convolve_transposed(LayerImage& image, LayerWeights weights, int padding, const std::string& name) {
    nlohmann::json fields{
        {"type", "transposed_convolution"}, {"size", weights.size}, {"stride", weights.stride}, {"padding", padding}};
    if (weights.groups > 1) fields["groups"] = weights.groups;
    image.channels = weights.out;
    image.grown *= weights.stride;
    fields["tensor"] =
        add_tensors(name, {weights.in, weights.out / weights.groups, weights.size, weights.size}, std::move(weights));
    add(image, std::move(fields));
}

void LayerList::prelu(LayerImage& image, std::vector<float> slopes, const std::string& name) {
    LayerWeights weights;
    const std::vector<int64_t> shape{std::ssize(slopes)};
    weights.weights = std::move(slopes);
    std::string tensor = add_tensors(name, shape, std::move(weights));
    add(image, {{"type", "prelu"}, {"tensor", std::move(tensor)}});
}

void LayerList::scale(LayerImage& image, const std::vector<double>& factors, const std::vector<double>& addends) {
    const auto count = static_cast<size_t>(image.channels);
    if (!image.is_plain_convolution) {
        LayerWeights each{image.channels, image.channels, 1, 1, image.channels, {}, {}};
        each.weights.assign(factors.begin(), factors.end());
        each.biases.assign(addends.begin(), addends.end());
        convolve(image, std::move(each), "");
        return;
    }
    const std::string name = layers_[static_cast<size_t>(image.layer)]["tensor"];
    Named& weights = tensors_[name + ".weight"];
    Named& biases = tensors_[name + ".bias"];
    if (biases.values.empty()) biases = {{image.channels}, std::vector<float>(count)};
    const size_t each = weights.values.size() / count;
    for (size_t i = 0; i < weights.values.size(); ++i)
        weights.values[i] = static_cast<float>(weights.values[i] * factors[i / each]);
    for (size_t i = 0; i < count; ++i)
        biases.values[i] = static_cast<float>(biases.values[i] * factors[i] + addends[i]);
}

void LayerList::pick(LayerImage& image, const std::vector<int>& sources) {
    const auto count = sources.size();
    const bool has_groups = image.is_plain_convolution && layers_[static_cast<size_t>(image.layer)].contains("groups");
    if (!image.is_plain_convolution || has_groups) {
        LayerWeights each{static_cast<int>(count), image.channels, 1, 1, 1, {}, {}};
        each.weights.resize(count * static_cast<size_t>(image.channels));
        for (size_t i = 0; i < count; ++i)
            each.weights[i * static_cast<size_t>(image.channels) + static_cast<size_t>(sources[i])] = 1;
        convolve(image, std::move(each), "");
        return;
    }
    const std::string name = layers_[static_cast<size_t>(image.layer)]["tensor"];
    for (const char* part : {".weight", ".bias"}) {
        const auto found = tensors_.find(name + part);
        if (found == tensors_.end()) continue;
        Named& tensor = found->second;
        const std::vector<float> before = std::exchange(tensor.values, {});
        const auto each = std::ssize(before) / image.channels;
        for (const int source : sources)
            tensor.values.insert(tensor.values.end(), before.begin() + source * each,
                                 before.begin() + (source + 1) * each);
        weights_ += static_cast<double>(tensor.values.size()) - static_cast<double>(before.size());
        tensor.shape.front() = std::ssize(sources);
    }
    image.channels = static_cast<int>(count);
}

void LayerList::depth_to_space(LayerImage& image, int scale) {
    add(image, {{"type", "depth_to_space"}, {"scale", scale}});
    image.channels /= scale * scale;
    image.grown *= scale;
}

std::string LayerList::bytes(const std::map<std::string, std::string>& metadata) const {
    std::map<std::string, std::string> all = metadata;
    all["layers"] = layers_.dump();
    std::map<std::string, io::NewTensor> tensors;
    for (const auto& [name, tensor] : tensors_)
        tensors[name] = io::NewTensor::of<float>(io::DataType::f32, tensor.shape, tensor.values);
    return io::safetensors_bytes(all, tensors);
}

}  // namespace clarus::pipelines
