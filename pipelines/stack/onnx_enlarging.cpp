#include <algorithm>
#include <cmath>

#include "pipelines/stack/onnx_sizes.h"
#include "pipelines/stack/onnx_translator.h"

// Operators that make an image larger, and what tells its size.
namespace clarus::pipelines {

void OnnxTranslator::require_growth(const OnnxNodeReader& node, const OnnxImage& image, int64_t scale) const {
    if (scale < 1 || scale > kLargestStackScale || image.grown * scale > kLargestStackGrowth)
        node.refuse("it makes an image {} times as large; up to {}, and {} in all, are taken", scale,
                    kLargestStackScale, kLargestStackGrowth);
}

void OnnxTranslator::depth_to_space(const OnnxNodeReader& node) {
    const std::string mode = node.text("mode", "DCR");
    if (mode != "DCR" && mode != "CRD") node.refuse("its mode is {}; DCR and CRD are taken", mode);
    shuffle(node, image(node, 0), node.integer("blocksize", 0), mode == "CRD");
}

void OnnxTranslator::shuffle(const OnnxNodeReader& node, OnnxImage result, int64_t scale, bool is_crd) {
    require_growth(node, result, scale);
    const int squared = static_cast<int>(scale * scale), channels = result.channels / squared;
    if (result.channels % squared != 0)
        node.refuse("{} channels cannot be made blocks of {} by {} pixels", result.channels, scale, scale);
    if (!is_crd) {
        std::vector<int> sources;
        for (int channel = 0; channel < result.channels; ++channel)
            sources.push_back(channel % squared * channels + channel / squared);
        layers_.pick(result, sources);
    }
    if (scale > 1) layers_.depth_to_space(result, static_cast<int>(scale));
    set(node, result);
}

void OnnxTranslator::reshape(const OnnxNodeReader& node) {
    const std::string& name = node.input(0);
    if (!images_.contains(name)) node.refuse("its input {} must be an image", name);
    OnnxImage result = images_.at(name);
    const std::array<int64_t, 4> extents = shape(result);
    std::vector<int64_t> wanted = sizes(node, 1);
    for (size_t i = 0; i < wanted.size(); ++i)
        if (wanted[i] == 0 && i < 4 && !result.is_split()) wanted[i] = extents[i];
    infer(wanted, extents[1] * extents[2] * extents[3]);
    if (result.shuffle != 0) {
        const int64_t s = result.shuffle;
        const std::vector<int64_t> shuffled{1, extents[1] / (s * s), extents[2] * s, extents[3] * s};
        if (wanted == shuffled) {
            result.split = {};
            result.shuffle = 0;
            return shuffle(node, result, s, result.is_crd);
        }
    } else if (!result.is_split()) {
        if (std::ranges::equal(wanted, extents)) return set(node, result);
        const bool is_depth = wanted.size() == 6 && wanted[0] == 1 && wanted[1] > 0 && wanted[2] > 0 && wanted[3] > 0 &&
                              wanted[1] <= extents[1] && wanted[2] <= extents[1] && wanted[3] <= extents[1] &&
                              wanted[1] * wanted[2] * wanted[3] == extents[1] && wanted[4] == extents[2] &&
                              wanted[5] == extents[3];
        if (is_depth) {
            result.split = {wanted[1], wanted[2], wanted[3]};
            return set(node, result);
        }
    }
    node.refuse("Reshape and Transpose are taken as a pixel shuffle alone");
}

void OnnxTranslator::infer(std::vector<int64_t>& extents, int64_t elements) {
    const auto open = std::ranges::find(extents, -1);
    if (open == extents.end()) return;
    for (const int64_t extent : extents)
        if (extent > 0) elements = elements % extent == 0 ? elements / extent : 0;
    *open = elements;
}

void OnnxTranslator::transpose(const OnnxNodeReader& node) {
    const std::string& name = node.input(0);
    if (!images_.contains(name)) node.refuse("its input {} must be an image", name);
    OnnxImage result = images_.at(name);
    const std::vector<int64_t> order = node.integers("perm").value_or(std::vector<int64_t>{});
    if (!result.is_split() && order == std::vector<int64_t>{0, 1, 2, 3}) return set(node, result);
    const auto [a, b, c] = result.split;
    const bool is_crd = order == std::vector<int64_t>{0, 1, 4, 2, 5, 3} && b == c;
    const bool is_dcr = order == std::vector<int64_t>{0, 3, 4, 1, 5, 2} && a == b;
    if (!result.is_split() || result.shuffle != 0 || (!is_crd && !is_dcr))
        node.refuse("Reshape and Transpose are taken as a pixel shuffle alone");
    require_growth(node, result, b);
    result.shuffle = static_cast<int>(b);
    result.is_crd = is_crd;
    set(node, result);
}

int64_t OnnxTranslator::resize_scale(const OnnxNodeReader& node, const OnnxImage& image) const {
    const bool is_upsample = node->op == "Upsample";
    const size_t at = is_upsample || node.opset() < 11 ? 1 : 2;
    const std::array<int64_t, 4> extents = shape(image);
    std::vector<double> factors;
    if (node.has_input(3)) {
        const std::vector<int64_t>& wanted = sizes(node, 3);
        for (size_t i = 0; i < wanted.size() && i < 4; ++i)
            factors.push_back(static_cast<double>(wanted[i]) / static_cast<double>(extents[i]));
    } else if (node.has_input(at)) {
        const std::vector<float>& values = floats(node, at);
        if (values.size() == 4) factors.assign(values.begin(), values.end());
    } else if (const auto values = node.numbers("scales")) {
        factors.assign(values->begin(), values->end());
    }
    const bool is_whole = factors.size() == 4 && factors[0] == 1 && factors[1] == 1 && factors[2] == factors[3] &&
                          factors[2] >= 1 && factors[2] <= kLargestStackScale && factors[2] == std::floor(factors[2]);
    if (!is_whole) node.refuse("its scales must be 1, 1 and twice a whole number up to {}", kLargestStackScale);
    return static_cast<int64_t>(factors[2]);
}

void OnnxTranslator::resize(const OnnxNodeReader& node) {
    OnnxImage result = image(node, 0);
    const int64_t scale = resize_scale(node, result);
    require_growth(node, result, scale);
    const bool is_asymmetric = node->op == "Upsample" || node.opset() < 11;
    const std::string mode = node.text("mode", "nearest");
    const std::string where = node.text("coordinate_transformation_mode", is_asymmetric ? "asymmetric" : "half_pixel");
    const std::string rounding = node.text("nearest_mode", is_asymmetric ? "floor" : "round_prefer_floor");
    const bool is_centred = where == "half_pixel" || where == "pytorch_half_pixel";
    if (mode == "nearest") {
        const bool is_nearest = rounding == "floor" ? where == "asymmetric" || where == "tf_half_pixel_for_nn"
                                                    : is_centred && rounding.starts_with("round_prefer");
        if (!is_nearest)
            node.refuse(
                "nearest pixels by {} and {} are not taken; asymmetric and floor are, half_pixel and "
                "round_prefer_floor",
                where, rounding);
        repeat(node, result, static_cast<int>(scale));
    } else if (mode == "linear" && is_centred) {
        if (scale > 1) layers_.add(result, {{"type", "upsample"}, {"scale", scale}});
        result.grown *= static_cast<int>(scale);
    } else {
        node.refuse("the mode {} by {} is not taken; nearest is, and linear by half_pixel", mode, where);
    }
    set(node, result);
}

void OnnxTranslator::repeat(const OnnxNodeReader& node, OnnxImage& image, int scale) {
    if (scale == 1) return;
    const int squared = scale * scale;
    require_channels(node, static_cast<double>(image.channels) * squared);
    LayerWeights each{image.channels * squared, image.channels, 1, 1, image.channels, {}, {}};
    each.weights.assign(static_cast<size_t>(each.out), 1);
    layers_.convolve(image, std::move(each), "");
    layers_.depth_to_space(image, scale);
}

void OnnxTranslator::sizes_of(const OnnxNodeReader& node) {
    const std::array<int64_t, 4> extents = shape(image(node, 0));
    const auto [begin, end] = sliced_range(4, node.integer("start", 0), node.integer("end", 4));
    define(node, 0);
    computed_[node->outputs.front()] = list_of({extents.begin() + begin, extents.begin() + end});
}

}  // namespace clarus::pipelines
