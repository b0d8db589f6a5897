#include "pipelines/stack/onnx_convolution.h"

#include <algorithm>

namespace clarus::pipelines {
namespace {

constexpr int64_t kLargestKernel = 31, kLargestStride = 8, kMostChannels = 1 << 12;

/// Along one axis.
struct Axis {
    int64_t size, dilation, stride, before, after;  // `before`, `after`: padding

    int64_t span() const { return (size - 1) * dilation; }  // from the first tap to the last
};

/// A list with an entry for each of the two axes.
std::vector<int64_t> pair_of(const OnnxNodeReader& node, const char* name, int64_t otherwise, int64_t low, int64_t high,
                             size_t count = 2) {
    const std::vector<int64_t> values = node.integers(name).value_or(std::vector<int64_t>(count, otherwise));
    if (values.size() != count) node.refuse("its {} are {} numbers; {} are taken", name, values.size(), count);
    for (const int64_t value : values)
        if (value < low || value > high) node.refuse("its {} has {}; from {} to {} are taken", name, value, low, high);
    return values;
}

/// Height, then width.
std::vector<Axis> axes_of(const OnnxNodeReader& node, const io::OnnxTensor& weights) {
    const std::vector<int64_t>& shape = weights.shape;
    if (shape.size() != 4) node.refuse("its weights have {} extents; those of images, 4, are taken", shape.size());
    for (const int64_t size : {shape[2], shape[3]})
        if (size < 1 || size > kLargestKernel)
            node.refuse("its kernel is {} by {}; up to {} are taken", shape[2], shape[3], kLargestKernel);
    if (const auto kernel = node.integers("kernel_shape"); kernel && *kernel != std::vector{shape[2], shape[3]})
        node.refuse("its kernel_shape is not that of its weights, {} by {}", shape[2], shape[3]);
    const auto dilations = pair_of(node, "dilations", 1, 1, kLargestKernel);
    const auto strides = pair_of(node, "strides", 1, 1, kLargestStride);
    if (strides[0] != strides[1])
        node.refuse("its strides are {} and {}; equal ones are taken", strides[0], strides[1]);
    const auto pads = pair_of(node, "pads", 0, 0, kLargestKernel, 4);
    std::vector<Axis> axes;
    for (size_t i = 0; i < 2; ++i) axes.push_back({shape[2 + i], dilations[i], strides[i], pads[i], pads[2 + i]});
    return axes;
}

/// In place of `pads`: as much as keeps an image's size, which is a multiple of the stride.
void pad_automatically(const OnnxNodeReader& node, std::vector<Axis>& axes) {
    const std::string way = node.text("auto_pad", "NOTSET");
    if (way == "NOTSET") return;
    if (way != "VALID" && way != "SAME_UPPER" && way != "SAME_LOWER") node.refuse("its auto_pad is {}", way);
    for (Axis& axis : axes) {
        const int64_t all = way == "VALID" ? 0 : std::max<int64_t>(axis.span() + 1 - axis.stride, 0);
        axis.before = way == "SAME_LOWER" ? all - all / 2 : all / 2;
        axis.after = all - axis.before;
    }
}

LayerWeights sizes_of(const OnnxNodeReader& node, int64_t out, int64_t in, int64_t groups, int channels,
                      const std::vector<float>* biases) {
    if (in != channels) node.refuse("its weights are for {} channels; the image has {}", in, channels);
    if (out < 1 || out > kMostChannels || out % groups != 0)
        node.refuse("it makes {} channels; from 1 to {}, a multiple of its group, are taken", out, kMostChannels);
    if (biases && std::ssize(*biases) != out) node.refuse("it has {} biases for {} channels", biases->size(), out);
    LayerWeights result;
    result.out = static_cast<int>(out);
    result.in = static_cast<int>(in);
    result.groups = static_cast<int>(groups);
    if (biases) result.biases = *biases;
    return result;
}

int64_t groups_of(const OnnxNodeReader& node) {
    const int64_t groups = node.integer("group", 1);
    if (groups < 1 || groups > kMostChannels) node.refuse("its group is {}", groups);
    return groups;
}

}  // namespace

LayerWeights read_convolution(const OnnxNodeReader& node, const io::OnnxTensor& weights,
                              const std::vector<float>* biases, int channels, double most_weights) {
    std::vector<Axis> axes = axes_of(node, weights);
    pad_automatically(node, axes);
    const int64_t groups = groups_of(node);
    const int64_t each = weights.shape[1];  // channels that an output is made of
    if (each < 1 || each > kMostChannels) node.refuse("its weights are for {} channels a group", each);
    LayerWeights result = sizes_of(node, weights.shape[0], each * groups, groups, channels, biases);
    int64_t radius = 0;
    for (const Axis& axis : axes) {
        // Output q takes input q · stride − before + tap · dilation, and of a multiple of the stride there are to be as
        // many outputs as multiples.
        const int64_t beyond = axis.before + axis.after - axis.span();
        if (beyond > 0 || beyond <= -axis.stride)
            node.refuse("its pads {} and {} make of a side of n pixels not n / {}: a kernel of {} wants {} in all",
                        axis.before, axis.after, axis.stride, axis.span() + 1, axis.span());
        radius = std::max({radius, axis.before, axis.span() - axis.before});
    }
    const int64_t size = 2 * radius + 1;
    if (size > kLargestKernel)
        node.refuse("its kernel reaches {} pixels from the middle; up to {} are taken", radius, kLargestKernel / 2);
    const int64_t kernels = static_cast<int64_t>(result.out) * each;
    if (static_cast<double>(kernels * size * size) > most_weights)
        node.refuse("layers up to it have more weights than are taken");
    result.size = static_cast<int>(size);
    result.stride = static_cast<int>(axes[0].stride);
    result.weights.resize(static_cast<size_t>(kernels * size * size));
    const Axis &down = axes[0], &across = axes[1];
    for (int64_t kernel = 0; kernel < kernels; ++kernel) {
        for (int64_t y = 0; y < down.size; ++y) {
            for (int64_t x = 0; x < across.size; ++x) {
                const int64_t row = radius - down.before + y * down.dilation;
                const int64_t column = radius - across.before + x * across.dilation;
                result.weights[static_cast<size_t>((kernel * size + row) * size + column)] =
                    weights.floats[static_cast<size_t>((kernel * down.size + y) * across.size + x)];
            }
        }
    }
    return result;
}

TransposedConvolution read_transposed_convolution(const OnnxNodeReader& node, const io::OnnxTensor& weights,
                                                  const std::vector<float>* biases, int channels) {
    if (node.text("auto_pad", "NOTSET") != "NOTSET" || node.integers("output_shape"))
        node.refuse("pads are taken, no auto_pad or output_shape");
    const std::vector<Axis> axes = axes_of(node, weights);
    const Axis& axis = axes.front();
    const auto beyond = pair_of(node, "output_padding", 0, 0, kLargestStride);
    const bool is_square = axes[0].size == axes[1].size && axes[0].before == axes[1].before &&
                           axes[0].after == axes[1].after && axes[0].dilation == 1 && axes[1].dilation == 1 &&
                           axes[0].before == axes[0].after && beyond[0] == beyond[1];
    if (!is_square) node.refuse("a square kernel without dilations, padded alike at all sides, is taken");
    // What a stack's layer has, which always makes an image `stride` times as large.
    if (beyond[0] != axis.stride + 2 * axis.before - axis.size || beyond[0] >= axis.stride || axis.before >= axis.size)
        node.refuse(
            "with strides {}, a kernel of {} and pads {} its output_padding must be {} for an image {} times "
            "as large, and less than {}; it is {}",
            axis.stride, axis.size, axis.before, axis.stride + 2 * axis.before - axis.size, axis.stride, axis.stride,
            beyond[0]);
    const int64_t groups = groups_of(node);
    if (weights.shape[1] < 1 || weights.shape[1] > kMostChannels || channels % groups != 0)
        node.refuse("its weights of {} by {} channels in {} groups do not fit", weights.shape[0], weights.shape[1],
                    groups);
    TransposedConvolution result{sizes_of(node, weights.shape[1] * groups, weights.shape[0], groups, channels, biases),
                                 static_cast<int>(axis.before)};
    result.weights.size = static_cast<int>(axis.size);
    result.weights.stride = static_cast<int>(axis.stride);
    result.weights.weights = weights.floats;
    return result;
}

}  // namespace clarus::pipelines
