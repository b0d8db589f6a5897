#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "io/safetensors.h"

namespace clarus::pipelines {

/// What a layer of a stack leaves, while its list is being made.
struct LayerImage {
    int layer = -1;  // its number; −1 is the network's input
    int channels = 0;
    int grown = 1, shrunk = 1;  // how many times as large as the input it is
    /// It is a convolution's result that nothing else reads: what is done to each channel the weights can do.
    bool is_plain_convolution = false;
};

/// A convolution's weights [out][in / groups][size][size] and biases [out].
struct LayerWeights {
    int out = 0, in = 0, size = 1, stride = 1, groups = 1;
    std::vector<float> weights, biases;
};

/// A list of layers for pipelines/stack in the making, with its tensors.
class LayerList {
  public:
    /// A layer that takes `image`, with other fields than those that say what it takes. Changes what it leaves.
    void add(LayerImage& image, nlohmann::json fields);
    /// A convolution, its tensor named so, or by the layer's number where the name is taken or is none.
    void convolve(LayerImage& image, LayerWeights weights, const std::string& name);
    /// Weights [in][out / groups][size][size], output sides `stride` times the input's.
    void convolve_transposed(LayerImage& image, LayerWeights weights, int padding, const std::string& name);
    void prelu(LayerImage& image, std::vector<float> slopes, const std::string& name);
    /// Each channel times a factor and more by an addend: by the convolution before, if that is all it is for.
    void scale(LayerImage& image, const std::vector<double>& factors, const std::vector<double>& addends);
    /// Channel i is made the one that was number sources[i], which may be more or fewer than there are.
    void pick(LayerImage& image, const std::vector<int>& sources);
    void depth_to_space(LayerImage& image, int scale);

    int last() const { return static_cast<int>(layers_.size()) - 1; }
    /// How many weights there are by now.
    double weights() const { return weights_; }
    /// The bytes of a model file.
    std::string bytes(const std::map<std::string, std::string>& metadata) const;

  private:
    struct Named {
        std::vector<int64_t> shape;
        std::vector<float> values;
    };

    std::string tensor_name(const std::string& wanted) const;
    std::string add_tensors(const std::string& wanted, std::vector<int64_t> shape, LayerWeights weights);

    nlohmann::json layers_ = nlohmann::json::array();
    std::map<std::string, Named> tensors_;
    double weights_ = 0;
};

}  // namespace clarus::pipelines
