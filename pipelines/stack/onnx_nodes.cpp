#include <algorithm>
#include <cmath>

#include "pipelines/stack/onnx_convolution.h"
#include "pipelines/stack/onnx_sizes.h"
#include "pipelines/stack/onnx_translator.h"

// Operators that leave an image as large as it is, and convolutions.
namespace clarus::pipelines {

using io::OnnxTensor;

void OnnxTranslator::add(const OnnxNodeReader& node, nlohmann::json fields) {
    OnnxImage result = image(node, 0);
    layers_.add(result, std::move(fields));
    set(node, result);
}

void OnnxTranslator::slice(OnnxImage& image, int first, int count) {
    layers_.add(image, {{"type", "slice"}, {"channels", {first, count}}});
    image.channels = count;
}

void OnnxTranslator::require_channels(const OnnxNodeReader& node, double count) const {
    if (count < 1 || count > kMostStackChannels)
        node.refuse("it makes an image of {:.0f} channels; from 1 to {} are taken", count, kMostStackChannels);
}

void OnnxTranslator::identity(const OnnxNodeReader& node) {
    const std::string& name = node.input(0);
    images_.contains(name) ? set(node, images_.at(name)) : node.refuse("its input {} must be an image", name);
}

void OnnxTranslator::cast(const OnnxNodeReader& node) {
    const int64_t to = node.integer("to", 0);
    if (to != 1 && to != 10 && to != 11) node.refuse("an image may be of FLOAT, FLOAT16 or DOUBLE, not type {}", to);
    identity(node);
}

void OnnxTranslator::dropout(const OnnxNodeReader& node) {
    if (node.has_input(2) || (node->outputs.size() > 1 && uses(node->outputs[1]) > 0))
        node.refuse("a network in training is not taken: export it for inference");
    identity(node);
}

void OnnxTranslator::convolution(const OnnxNodeReader& node) {
    OnnxImage result = image(node, 0);
    const OnnxTensor& weights = known(node, 1);
    floats(node, 1);
    const std::vector<float>* biases = node.has_input(2) ? &floats(node, 2) : nullptr;
    layers_.convolve(result, read_convolution(node, weights, biases, result.channels, weights_left()), node.input(1));
    if (kLargestStackScale % result.shrunk != 0)
        node.refuse("strides up to it shrink the image {} times; a divisor of {} is taken", result.shrunk,
                    kLargestStackScale);
    result.is_plain_convolution = true;
    set(node, result);
}

void OnnxTranslator::transposed_convolution(const OnnxNodeReader& node) {
    OnnxImage result = image(node, 0);
    const OnnxTensor& weights = known(node, 1);
    floats(node, 1);
    const std::vector<float>* biases = node.has_input(2) ? &floats(node, 2) : nullptr;
    TransposedConvolution layer = read_transposed_convolution(node, weights, biases, result.channels);
    require_growth(node, result, layer.weights.stride);
    layers_.convolve_transposed(result, std::move(layer.weights), layer.padding, node.input(1));
    set(node, result);
}

void OnnxTranslator::leaky_relu(const OnnxNodeReader& node) {
    OnnxImage result = image(node, 0);
    const float slope = node.number("alpha", 0.01f);
    if (!std::isfinite(slope)) node.refuse("its alpha is {}", slope);
    layers_.prelu(result, {slope}, "");
    set(node, result);
}

void OnnxTranslator::prelu(const OnnxNodeReader& node) {
    OnnxImage result = image(node, 0);
    layers_.prelu(result, by_channel(node, 1, result.channels, true), node.input(1));
    set(node, result);
}

std::vector<float> OnnxTranslator::by_channel(const OnnxNodeReader& node, size_t i, int channels,
                                              bool may_be_one) const {
    std::vector<float> values = floats(node, i);
    if (values.size() == 1) {
        if (!may_be_one) values.resize(static_cast<size_t>(channels), values.front());
        return values;
    }
    const std::vector<int64_t>& extents = known(node, i).shape;
    // From the last extent: width, height, channels, images.
    for (size_t k = 0; k < extents.size(); ++k)
        if (extents[extents.size() - 1 - k] != (k == 2 ? channels : 1))
            node.refuse("its constant {} must be one number, or have the shape [{}, 1, 1]", node.input(i), channels);
    return values;
}

void OnnxTranslator::clip(const OnnxNodeReader& node) {
    const auto bound = [&](const char* attribute, size_t i, float otherwise) {
        if (!node.has_input(i)) return node.number(attribute, otherwise);
        if (floats(node, i).size() != 1) node.refuse("its bounds must be single numbers");
        return floats(node, i).front();
    };
    constexpr float kNone = 1e30f;
    const float low = bound("min", 1, -kNone), high = bound("max", 2, kNone);
    if (!(low <= high)) node.refuse("its bounds are {} and {}", low, high);
    if (low == 0 && high >= kNone) return relu(node);
    add(node, {{"type", "clamp"}, {"low", std::max(low, -kNone)}, {"high", std::min(high, kNone)}});
}

void OnnxTranslator::softmax(const OnnxNodeReader& node) {
    constexpr int64_t kFirstByAxis = 13;  // earlier ones are over all that follows the axis
    if (node.opset() < kFirstByAxis) node.refuse("of operators before opset {} it is not taken", kFirstByAxis);
    require_channel_axis(node, node.integer("axis", -1));
    add(node, {{"type", "softmax"}});
}

void OnnxTranslator::require_channel_axis(const OnnxNodeReader& node, int64_t axis) {
    if (axis != 1 && axis != -3) node.refuse("its axis is {}; 1, that of channels, is taken", axis);
}

void OnnxTranslator::arithmetic(const OnnxNodeReader& node, const std::string& layer) {
    if (node->inputs.size() != 2) node.refuse("two inputs are taken");
    if (!constant(node.input(0)) && !constant(node.input(1))) {
        if (layer.empty()) node.refuse("one of its inputs must be a constant");
        return together(node, layer);
    }
    const size_t other = constant(node.input(0)) ? 0 : 1;
    OnnxImage result = image(node, 1 - other);
    const std::vector<float> values = by_channel(node, other, result.channels);
    std::vector<double> factors(values.size(), 1), addends(values.size(), 0);
    for (size_t i = 0; i < values.size(); ++i) {
        const double value = values[i];
        if (node->op == "Add") addends[i] = value;
        if (node->op == "Mul") factors[i] = value;
        if (node->op == "Sub") {
            factors[i] = other == 1 ? 1 : -1;
            addends[i] = other == 1 ? -value : value;
        }
        if (node->op == "Div") {
            if (other == 0 || value == 0) node.refuse("an image may be divided by a constant other than 0 alone");
            factors[i] = 1 / value;
        }
    }
    layers_.scale(result, factors, addends);
    set(node, result);
}

void OnnxTranslator::together(const OnnxNodeReader& node, const std::string& layer) {
    OnnxImage a = image(node, 0), b = image(node, 1);
    if (b.layer == layers_.last()) std::swap(a, b);  // the last layer is taken without saying so
    join_size(node, a, b);
    if (a.channels != b.channels && a.channels != 1 && b.channels != 1)
        node.refuse("it combines images of {} and {} channels", a.channels, b.channels);
    const int channels = std::max(a.channels, b.channels);
    layers_.add(a, {{"type", layer}, {"with", b.layer}});
    a.channels = channels;
    set(node, a);
}

void OnnxTranslator::join_size(const OnnxNodeReader& node, OnnxImage& a, const OnnxImage& b) {
    if (a.grown * b.shrunk != b.grown * a.shrunk)
        node.refuse("it combines an image {} times as large as the input with one {} times as large", scale_text(a),
                    scale_text(b));
    if (b.shrunk > a.shrunk) {
        a.grown = b.grown;
        a.shrunk = b.shrunk;
    }
}

void OnnxTranslator::concatenate(const OnnxNodeReader& node) {
    require_channel_axis(node, node.integer("axis", 1));
    std::vector<OnnxImage> parts;
    double channels = 0;
    for (size_t i = 0; i < node->inputs.size(); ++i) {
        if (image_or_none(node, i).channels == 0) continue;
        parts.push_back(image(node, i));
        channels += parts.back().channels;
    }
    require_channels(node, channels);
    OnnxImage result = parts.front();
    nlohmann::json others = nlohmann::json::array();
    for (size_t i = 1; i < parts.size(); ++i) {
        join_size(node, result, parts[i]);
        others.push_back(parts[i].layer);
    }
    if (others.empty()) return set(node, result);
    layers_.add(result, {{"type", "concatenate"}, {"with", std::move(others)}});
    result.channels = static_cast<int>(channels);
    set(node, result);
}

void OnnxTranslator::normalization(const OnnxNodeReader& node) {
    node.expect("training_mode", 0);
    OnnxImage result = image(node, 0);
    const auto count = static_cast<size_t>(result.channels);
    for (size_t i = 1; i <= 4; ++i)
        if (floats(node, i).size() != count) node.refuse("its input {} must have {} elements", i, count);
    const double epsilon = node.number("epsilon", 1e-5f);
    std::vector<double> factors(count), addends(count);
    for (size_t i = 0; i < count; ++i) {
        factors[i] = floats(node, 1)[i] / std::sqrt(floats(node, 4)[i] + epsilon);
        addends[i] = floats(node, 2)[i] - floats(node, 3)[i] * factors[i];
        if (!std::isfinite(factors[i])) node.refuse("its variance {} is {}", i, floats(node, 4)[i]);
    }
    layers_.scale(result, factors, addends);
    set(node, result);
}

std::optional<std::vector<int64_t>> OnnxTranslator::list(const OnnxNodeReader& node, const char* attribute,
                                                         size_t i) const {
    return node.has_input(i) ? std::optional(sizes(node, i)) : node.integers(attribute);
}

void OnnxTranslator::slice(const OnnxNodeReader& node) {
    OnnxImage result = image(node, 0);
    const auto starts = list(node, "starts", 1), ends = list(node, "ends", 2), axes = list(node, "axes", 3);
    const auto steps = list(node, "steps", 4);
    if (!starts || !ends || starts->size() != ends->size() || (axes && axes->size() != starts->size()) ||
        (steps && steps->size() != starts->size()))
        node.refuse("its starts, ends, axes and steps must be as many");
    const std::array<int64_t, 4> extents = shape(result);
    for (size_t i = 0; i < starts->size(); ++i) {
        const int64_t given = axes ? (*axes)[i] : static_cast<int64_t>(i);
        const int64_t axis = given < 0 ? given + 4 : given;
        if (axis < 0 || axis > 3 || (steps && (*steps)[i] != 1)) node.refuse("a part of consecutive channels is taken");
        const auto [begin, end] = sliced_range(extents[static_cast<size_t>(axis)], (*starts)[i], (*ends)[i]);
        if (axis != 1) {
            if (begin != 0 || end != extents[static_cast<size_t>(axis)])
                node.refuse("a part of the channels is taken, none of the pixels");
            continue;
        }
        if (result.channels != extents[1]) node.refuse("it names the axis of channels twice");
        if (end == begin)
            result.channels = 0;
        else if (end - begin < result.channels)
            slice(result, static_cast<int>(begin), static_cast<int>(end - begin));
    }
    set(node, result);
}

void OnnxTranslator::split(const OnnxNodeReader& node) {
    require_channel_axis(node, node.integer("axis", 0));
    const OnnxImage whole = image(node, 0);
    const auto parts = std::ssize(node->outputs);
    std::vector<int64_t> counts(node->outputs.size(), whole.channels / parts);
    if (const auto given = list(node, "split", 1)) counts = *given;
    int64_t sum = 0;
    for (const int64_t count : counts) {
        require_channels(node, static_cast<double>(count));
        sum += count;
    }
    if (std::ssize(counts) != parts || sum != whole.channels)
        node.refuse("it makes {} parts of {} channels in all of {} channels", parts, sum, whole.channels);
    int64_t first = 0;
    for (size_t i = 0; i < counts.size(); ++i) {
        if (!node->outputs[i].empty() && uses(node->outputs[i]) > 0) {
            OnnxImage part = whole;
            slice(part, static_cast<int>(first), static_cast<int>(counts[i]));
            set(node, part, i);
        }
        first += counts[i];
    }
}

void OnnxTranslator::over_channels(const OnnxNodeReader& node) {
    node.expect("keepdims", 1);
    const auto axes = list(node, "axes", 1);
    if (!axes || axes->size() != 1) node.refuse("its axes must be one, 1, that of channels");
    require_channel_axis(node, axes->front());
    OnnxImage result = image(node, 0);
    layers_.add(result, {{"type", node->op == "ReduceMax" ? "maximum" : "sum"}});
    result.channels = 1;
    set(node, result);
}

}  // namespace clarus::pipelines
