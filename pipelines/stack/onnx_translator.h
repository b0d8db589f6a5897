#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "io/onnx.h"
#include "io/safetensors.h"
#include "pipelines/stack/layer_list.h"
#include "pipelines/stack/onnx_node.h"

namespace clarus::pipelines {

/// Of stacks (pipelines/stack/stack.cpp), where they are checked again.
inline constexpr int kMostStackChannels = 1 << 12, kLargestStackScale = 8, kLargestStackGrowth = 64;
inline constexpr double kMostStackWeights = 1 << 26;

/// An image on its way through the nodes.
struct OnnxImage : LayerImage {
    /// What a Reshape has made of its channels, until a Transpose and another Reshape have put pixels in their places.
    std::array<int64_t, 3> split{};
    int shuffle = 0;      // the scale of depth to space that is under way
    bool is_crd = false;  // whether the depth is in the order of a stack's
    bool is_split() const { return split[0] != 0; }
};

/// Goes through an ONNX network's nodes and makes a stack's layers of them. A function for each operator takes the node
/// and sets the images that it makes.
class OnnxTranslator {
  public:
    /// Which must stay until `translate` has returned.
    explicit OnnxTranslator(const io::OnnxGraph& network) : network_(network) {}

    /// Errors: those of stack_of.
    io::Safetensors translate();

  private:
    using Handler = void (OnnxTranslator::*)(const OnnxNodeReader&);
    static const std::map<std::string_view, Handler>& handlers();

    template <typename... Args>
    [[noreturn]] void refuse(fmt::format_string<Args...> format, Args&&... args) const {
        fail(ErrorKind::file, "{}: {}", network_.path.string(), fmt::format(format, std::forward<Args>(args)...));
    }

    // What goes in and out.

    void find_ports();

    static std::string names(const std::vector<io::OnnxPort>& ports);

    /// Which nodes the output is made of; how often each value is read by them.
    void find_needed();

    /// What cannot be taken is said before anything is computed.
    void require_known() const;

    void translate(const io::OnnxNode& node);

    io::Safetensors finish();

    static std::string scale_text(const LayerImage& image);

    // Values.

    const io::OnnxTensor* constant(const std::string& name) const;

    const io::OnnxTensor& known(const OnnxNodeReader& node, size_t i) const;

    /// Of FLOAT, FLOAT16 or DOUBLE; finite.
    const std::vector<float>& floats(const OnnxNodeReader& node, size_t i) const;

    const std::vector<int64_t>& sizes(const OnnxNodeReader& node, size_t i) const;

    /// An input that is an image with its pixels in place. Of what exporters cut off there may be none: 0 channels.
    OnnxImage image_or_none(const OnnxNodeReader& node, size_t i) const;

    OnnxImage image(const OnnxNodeReader& node, size_t i) const;

    std::array<int64_t, 4> shape(const OnnxImage& image) const;

    int uses(const std::string& name) const;

    /// Refuses a value that is there already.
    const std::string& define(const OnnxNodeReader& node, size_t output) const;

    void set(const OnnxNodeReader& node, OnnxImage image, size_t output = 0);

    // Layers.

    void add(const OnnxNodeReader& node, nlohmann::json fields);

    void slice(OnnxImage& image, int first, int count);

    void require_channels(const OnnxNodeReader& node, double count) const;

    void require_growth(const OnnxNodeReader& node, const OnnxImage& image, int64_t scale) const;

    void identity(const OnnxNodeReader& node);

    void cast(const OnnxNodeReader& node);

    void dropout(const OnnxNodeReader& node);

    void convolution(const OnnxNodeReader& node);

    void transposed_convolution(const OnnxNodeReader& node);

    double weights_left() const { return kMostStackWeights - layers_.weights(); }

    void relu(const OnnxNodeReader& node) { add(node, {{"type", "relu"}}); }
    void tanh(const OnnxNodeReader& node) { add(node, {{"type", "tanh"}}); }
    void sigmoid(const OnnxNodeReader& node) { add(node, {{"type", "sigmoid"}}); }

    void leaky_relu(const OnnxNodeReader& node);

    void prelu(const OnnxNodeReader& node);

    /// A constant that is one number, or one for each channel: of the shape [channels, 1, 1]. `may_be_one`: the first
    /// as it is.
    std::vector<float> by_channel(const OnnxNodeReader& node, size_t i, int channels, bool may_be_one = false) const;

    void clip(const OnnxNodeReader& node);

    void softmax(const OnnxNodeReader& node);

    static void require_channel_axis(const OnnxNodeReader& node, int64_t axis);

    // Of two values.

    void sum(const OnnxNodeReader& node) { arithmetic(node, "add"); }
    void product(const OnnxNodeReader& node) { arithmetic(node, "multiply"); }
    void difference(const OnnxNodeReader& node) { arithmetic(node, {}); }
    void quotient(const OnnxNodeReader& node) { arithmetic(node, {}); }

    void arithmetic(const OnnxNodeReader& node, const std::string& layer);

    void together(const OnnxNodeReader& node, const std::string& layer);

    /// Both must be as large.
    static void join_size(const OnnxNodeReader& node, OnnxImage& a, const OnnxImage& b);

    void concatenate(const OnnxNodeReader& node);

    void normalization(const OnnxNodeReader& node);

    // Parts of the channels, and over them.

    std::optional<std::vector<int64_t>> list(const OnnxNodeReader& node, const char* attribute, size_t i) const;

    void slice(const OnnxNodeReader& node);

    void split(const OnnxNodeReader& node);

    void over_channels(const OnnxNodeReader& node);

    // Larger images.

    void depth_to_space(const OnnxNodeReader& node);

    /// `is_crd`: channel c of the pixel (y, x) of a block is channel (c s + y) s + x of the depth, as a stack has it;
    /// else channel (y s + x) C + c.
    void shuffle(const OnnxNodeReader& node, OnnxImage result, int64_t scale, bool is_crd);

    void reshape(const OnnxNodeReader& node);

    /// Puts in the place of −1 what is left of so many elements.
    static void infer(std::vector<int64_t>& extents, int64_t elements);

    void transpose(const OnnxNodeReader& node);

    /// The whole number that an image's sides are multiplied by.
    int64_t resize_scale(const OnnxNodeReader& node, const OnnxImage& image) const;

    void resize(const OnnxNodeReader& node);

    /// Each pixel as a block: each channel so many times, from depth to space.
    void repeat(const OnnxNodeReader& node, OnnxImage& image, int scale);

    /// An image's shape as numbers.
    void sizes_of(const OnnxNodeReader& node);

    [[noreturn]] void of_sizes(const OnnxNodeReader& node) { node.refuse("it is taken of sizes, not of images"); }

    const io::OnnxGraph& network_;
    int channels_ = 0;
    int64_t height_ = 0, width_ = 0;
    std::vector<bool> needed_;
    std::map<std::string, int> uses_;
    std::map<std::string, OnnxImage> images_;
    std::map<std::string, io::OnnxTensor> computed_;
    LayerList layers_;
};

}  // namespace clarus::pipelines
