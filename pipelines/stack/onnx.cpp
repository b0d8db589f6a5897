#include "pipelines/stack/onnx.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "pipelines/stack/onnx_sizes.h"
#include "pipelines/stack/onnx_translator.h"

namespace clarus::pipelines {
namespace {

using io::OnnxTensor;

constexpr int64_t kLargestSide = 1 << 15;
/// Stand for sides that the file leaves open, where it computes with them: multiples of all strides, and unlike other
/// numbers that a file may have.
constexpr int64_t kAnyHeight = 8 * 1013, kAnyWidth = 8 * 1019;

}  // namespace

io::Safetensors OnnxTranslator::translate() {
    find_ports();
    find_needed();
    require_known();
    for (size_t i = 0; i < network_.nodes.size(); ++i)
        if (needed_[i]) translate(network_.nodes[i]);
    return finish();
}

void OnnxTranslator::find_ports() {
    if (network_.inputs.size() != 1)
        refuse("it has {} inputs{}; networks of one image are taken", network_.inputs.size(), names(network_.inputs));
    if (network_.outputs.size() != 1)
        refuse("it has {} outputs{}; networks that make one image are taken", network_.outputs.size(),
               names(network_.outputs));
    const io::OnnxPort& input = network_.inputs.front();
    if (input.type != "FLOAT" && input.type != "FLOAT16")
        refuse("its input {} is of the type {}; images of FLOAT or FLOAT16 are taken, display values from 0 to 1",
               input.name, input.type);
    if (!input.shape || input.shape->size() != 4)
        refuse("its input {} has no shape of four extents; [1, channels, height, width] is taken", input.name);
    const std::vector<int64_t>& shape = *input.shape;
    if (shape[0] > 1) refuse("its input {} is {} images at once; one is taken", input.name, shape[0]);
    if (shape[1] != 1 && shape[1] != 3)
        refuse(
            "its input {} has {} channels; 3 (red, green, blue) or 1 (luma) are taken, as in [1, 3, height, "
            "width]",
            input.name, shape[1] < 0 ? "any number of" : std::to_string(shape[1]));
    for (const int64_t side : {shape[2], shape[3]})
        if (side > kLargestSide) refuse("its input {} has a side of {} pixels", input.name, side);
    channels_ = static_cast<int>(shape[1]);
    height_ = shape[2] > 0 ? shape[2] : kAnyHeight;
    width_ = shape[3] > 0 ? shape[3] : kAnyWidth;
    OnnxImage image;
    image.channels = channels_;
    images_[input.name] = image;
}

std::string OnnxTranslator::names(const std::vector<io::OnnxPort>& ports) {
    constexpr size_t kMost = 4;
    std::string text;
    for (size_t i = 0; i < std::min(kMost, ports.size()); ++i) text += (i ? ", " : " (") + ports[i].name;
    return text.empty() ? text : text + (ports.size() > kMost ? ", …)" : ")");
}

void OnnxTranslator::find_needed() {
    std::set<std::string> wanted{network_.outputs.front().name};
    ++uses_[network_.outputs.front().name];
    needed_.resize(network_.nodes.size());
    for (size_t i = network_.nodes.size(); i-- > 0;) {
        const io::OnnxNode& node = network_.nodes[i];
        needed_[i] = std::ranges::any_of(
            node.outputs, [&](const std::string& name) { return !name.empty() && wanted.contains(name); });
        if (!needed_[i]) continue;
        for (const std::string& name : node.inputs) {
            wanted.insert(name);
            ++uses_[name];
        }
    }
}

void OnnxTranslator::require_known() const {
    for (size_t i = 0; i < network_.nodes.size(); ++i) {
        const io::OnnxNode& node = network_.nodes[i];
        if (!needed_[i] || handlers().contains(node.op)) continue;
        std::string known;
        for (const auto& [op, handler] : handlers()) known += (known.empty() ? "" : ", ") + std::string(op);
        fail(ErrorKind::file,
             "{}: node {}: the operator {} is not taken; these are: {}. docs/formats.md, \"ONNX networks\", has "
             "what of each",
             network_.path.string(), node.name, node.op, known);
    }
}

void OnnxTranslator::translate(const io::OnnxNode& node) {
    const OnnxNodeReader reader(network_, node);
    if (node.outputs.empty() || node.outputs.front().empty()) reader.refuse("its first output has no name");
    std::vector<const OnnxTensor*> known;
    bool all_known = true;
    for (const std::string& name : node.inputs) {
        known.push_back(name.empty() ? nullptr : constant(name));
        all_known &= name.empty() || known.back();
        if (!name.empty() && !known.back() && !images_.contains(name))
            reader.refuse("it reads {}, which nothing before it makes", name);
    }
    if (all_known) {
        const std::optional<OnnxTensor> result = computed(reader, known);
        if (!result) reader.refuse("it reads no image");
        define(reader, 0);
        computed_[node.outputs.front()] = *result;
        return;
    }
    (this->*handlers().at(node.op))(reader);
    if (layers_.weights() > kMostStackWeights)
        reader.refuse("layers up to it have more than {:.0f} weights in all", kMostStackWeights);
}

io::Safetensors OnnxTranslator::finish() {
    const std::string& name = network_.outputs.front().name;
    const auto found = images_.find(name);
    if (found == images_.end()) refuse("its output {} is no image that it makes of its input", name);
    OnnxImage result = found->second;
    if (result.is_split()) refuse("its output {} is no image [1, channels, height, width]", name);
    const bool is_whole = result.grown % result.shrunk == 0;
    if (result.channels != channels_ || !is_whole || result.grown / result.shrunk > kLargestStackScale)
        refuse(
            "it makes an image of {} channels, {} times as large, of one of {}; as many channels, from 1 to {} "
            "times as large, are taken",
            result.channels, scale_text(result), channels_, kLargestStackScale);
    // The last layer's image is the stack's; there is at least one layer.
    if (result.layer != layers_.last() || layers_.last() < 0) slice(result, 0, result.channels);
    return io::Safetensors::parse(layers_.bytes({{"pipeline", "stack"},
                                                 {"scale", std::to_string(result.grown / result.shrunk)},
                                                 {"network_color", channels_ == 1 ? "luma" : "rgb"}}),
                                  network_.path);
}

std::string OnnxTranslator::scale_text(const LayerImage& image) {
    return image.grown % image.shrunk == 0 ? std::to_string(image.grown / image.shrunk)
                                           : fmt::format("{}/{}", image.grown, image.shrunk);
}

const OnnxTensor* OnnxTranslator::constant(const std::string& name) const {
    if (const auto found = computed_.find(name); found != computed_.end()) return &found->second;
    const auto found = network_.tensors.find(name);
    return found == network_.tensors.end() ? nullptr : &found->second;
}

const OnnxTensor& OnnxTranslator::known(const OnnxNodeReader& node, size_t i) const {
    const OnnxTensor* tensor = constant(node.input(i));
    if (!tensor) node.refuse("its input {} ({}) must be a constant", i, node.input(i));
    return *tensor;
}

const std::vector<float>& OnnxTranslator::floats(const OnnxNodeReader& node, size_t i) const {
    const OnnxTensor& tensor = known(node, i);
    if (tensor.floats.empty())
        node.refuse("its input {} ({}) must have elements of FLOAT, not {} of {}", i, node.input(i),
                    tensor.integers.size(), tensor.type);
    for (const float value : tensor.floats)
        if (!std::isfinite(value)) node.refuse("its input {} ({}) has a value of {}", i, node.input(i), value);
    return tensor.floats;
}

const std::vector<int64_t>& OnnxTranslator::sizes(const OnnxNodeReader& node, size_t i) const {
    const OnnxTensor& tensor = known(node, i);
    constexpr size_t kMost = 16;
    if (tensor.shape.size() > 1 || tensor.integers.empty() || tensor.integers.size() > kMost)
        node.refuse("its input {} ({}) must be a list of whole numbers", i, node.input(i));
    return tensor.integers;
}

OnnxImage OnnxTranslator::image_or_none(const OnnxNodeReader& node, size_t i) const {
    const auto found = images_.find(node.input(i));
    if (found == images_.end()) node.refuse("its input {} ({}) must be an image", i, node.input(i));
    if (found->second.is_split())
        node.refuse("its input {} is a reshaped image: Reshape and Transpose are taken as a pixel shuffle alone", i);
    return found->second;
}

OnnxImage OnnxTranslator::image(const OnnxNodeReader& node, size_t i) const {
    OnnxImage result = image_or_none(node, i);
    if (result.channels == 0) node.refuse("its input {} ({}) is an image of no channels", i, node.input(i));
    return result;
}

std::array<int64_t, 4> OnnxTranslator::shape(const OnnxImage& image) const {
    return {1, image.channels, height_ * image.grown / image.shrunk, width_ * image.grown / image.shrunk};
}

int OnnxTranslator::uses(const std::string& name) const {
    const auto found = uses_.find(name);
    return found == uses_.end() ? 0 : found->second;
}

const std::string& OnnxTranslator::define(const OnnxNodeReader& node, size_t output) const {
    const std::string& name = node->outputs[output];
    if (images_.contains(name) || constant(name)) node.refuse("its output {} is made twice", name);
    return name;
}

void OnnxTranslator::set(const OnnxNodeReader& node, OnnxImage image, size_t output) {
    const std::string& name = define(node, output);
    image.is_plain_convolution = image.is_plain_convolution && uses(name) == 1;
    images_[name] = image;
}

const std::map<std::string_view, OnnxTranslator::Handler>& OnnxTranslator::handlers() {
    static const std::map<std::string_view, Handler> all{{"Add", &OnnxTranslator::sum},
                                                         {"BatchNormalization", &OnnxTranslator::normalization},
                                                         {"Cast", &OnnxTranslator::cast},
                                                         {"Clip", &OnnxTranslator::clip},
                                                         {"Concat", &OnnxTranslator::concatenate},
                                                         {"Constant", &OnnxTranslator::of_sizes},
                                                         {"Conv", &OnnxTranslator::convolution},
                                                         {"ConvTranspose", &OnnxTranslator::transposed_convolution},
                                                         {"DepthToSpace", &OnnxTranslator::depth_to_space},
                                                         {"Div", &OnnxTranslator::quotient},
                                                         {"Dropout", &OnnxTranslator::dropout},
                                                         {"Gather", &OnnxTranslator::of_sizes},
                                                         {"Identity", &OnnxTranslator::identity},
                                                         {"LeakyRelu", &OnnxTranslator::leaky_relu},
                                                         {"Mul", &OnnxTranslator::product},
                                                         {"PRelu", &OnnxTranslator::prelu},
                                                         {"ReduceMax", &OnnxTranslator::over_channels},
                                                         {"ReduceSum", &OnnxTranslator::over_channels},
                                                         {"Relu", &OnnxTranslator::relu},
                                                         {"Reshape", &OnnxTranslator::reshape},
                                                         {"Resize", &OnnxTranslator::resize},
                                                         {"Shape", &OnnxTranslator::sizes_of},
                                                         {"Sigmoid", &OnnxTranslator::sigmoid},
                                                         {"Slice", &OnnxTranslator::slice},
                                                         {"Softmax", &OnnxTranslator::softmax},
                                                         {"Split", &OnnxTranslator::split},
                                                         {"Squeeze", &OnnxTranslator::of_sizes},
                                                         {"Sub", &OnnxTranslator::difference},
                                                         {"Tanh", &OnnxTranslator::tanh},
                                                         {"Transpose", &OnnxTranslator::transpose},
                                                         {"Unsqueeze", &OnnxTranslator::of_sizes},
                                                         {"Upsample", &OnnxTranslator::resize}};
    return all;
}

io::Safetensors stack_of(const io::OnnxGraph& network) { return OnnxTranslator(network).translate(); }

}  // namespace clarus::pipelines
