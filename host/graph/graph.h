#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "clarus/types.h"
#include "graph/operators.h"
#include "graph/quantization.h"

namespace clarus::graph {

/// Logical NCHW with N = 1.
struct Shape {
    int channels = 0;
    int height = 0;
    int width = 0;
    size_t elements() const { return static_cast<size_t>(channels) * height * width; }
    friend bool operator==(const Shape&, const Shape&) = default;
};

/// A node's result. Nodes are numbered in an order in which each comes after its inputs.
using Value = int;

struct Node {
    Operator op;
    std::vector<Value> inputs;
    Shape shape;
    std::string name;  // what the profile and views call it
};

/// A convolution's weights: `sets` of them where they depend on the frame's jitter, else one.
struct Parameters {
    int out_channels = 0;
    int in_channels = 0;
    int sets = 1;
    bool conditioned = false;         // which set a frame uses is chosen by its jitter (Graph::jitter_kernels)
    int kernel = 3;                   // pixels along each side, odd
    int groups = 1;                   // each of so many output channels sees its group of the input channels alone
    int stride = 1;                   // between the input pixels that output pixels are around
    std::vector<float> weights = {};  // [sets][out][in / groups][kernel][kernel]
    std::vector<float> biases = {};   // [sets][out]
    bool avoid_winograd = false;      // what follows amplifies rounding errors beyond its own
    std::string layer = {};           // what the model calls it
    /// In place of `weights` and `biases`, which are empty then.
    std::optional<QuantizedWeights> quantized = {};

    size_t weights_per_set() const { return static_cast<size_t>(out_channels) * in_channels / groups * taps(); }
    int taps() const { return kernel * kernel; }
};

/// A fully connected layer, weights [out][in].
struct DenseLayer {
    int out = 0;
    int in = 0;
    std::vector<float> weights, biases;
};

/// How the sets of conditioned parameters follow from the frame's jitter (docs/pipelines.md, "Jitter-conditioned
/// kernels"): a table of jitters, one a set, and/or a perceptron (ReLU after all layers but the last) from J to all of
/// them, flattened in the order of `conditioned`, each weights then biases.
struct JitterKernels {
    std::vector<Vec2> table;  // empty and one set: that set serves every jitter
    std::vector<DenseLayer> predictor;
    std::vector<int> conditioned;  // indices into Graph::parameters
};

/// A value that is handed on to the next frame.
struct State {
    Value previous;  // a Previous node
    Value next;
};

/// What to compute each frame, without a device. Built by a pipeline, rewritten by passes.
class Graph {
  public:
    std::vector<Node> nodes;
    std::vector<std::shared_ptr<const Parameters>> parameters;  // passes copy graphs, which then share them
    std::optional<JitterKernels> jitter_kernels;
    std::vector<State> states;
    std::map<std::string, Value> views;      // what can be looked at, by name
    std::set<std::string> views_by_channel;  // those of which each channel is a picture
    Value output = -1;                       // display-encoded colour, 3 channels; −1 where another part makes it
    /// How far the history is believed: where this is 0, nothing of it is taken. Of render size, or larger by padding.
    /// −1 where no value says so; only of graphs as pipelines build them.
    Value history_trust = -1;
    std::vector<Value> exports;  // what other parts of the network read, in memory that is handed in

    const Shape& shape(Value value) const { return nodes[value].shape; }

    /// What is read when the frame's last kernel has run: the output where there is one, views and exports.
    std::vector<Value> results() const;
    /// Puts renamed(value) in the place of each of those, and of states' values.
    void rename_results(const std::function<Value(Value)>& renamed);

    Value input(Resource resource, Size size);
    Value plane(FrameScalar scalar, Size size);
    Value previous(Shape shape, std::string name);
    /// From the next frame on, `previous` (a result of previous()) is this frame's `next`.
    void carry(Value previous, Value next);

    Value upsample(Value image, int scale, Shift shift, std::string name);
    Value upsample_motion(Value motion, int scale, std::string name);
    Value resample(Value image, Filter filter, double scale, Size output_size, Shift shift = Shift::jitter);
    /// By Keys' bicubic, without jitter, of any values.
    Value resample_freely(Value image, double scale, Size output_size, std::string name);
    Value fit(Value image, Size size, std::string name);
    Value easu(Value color, double scale, Size output_size);
    Value rcas(Value color, float sharpness);
    Value dilate(Value motion, Value depth, int scale);
    Value depth_before(Value motion, Value depth);
    Value previous_depth(Value motion, Value depth);
    Value landed_depth(Value motion, Value depth, float share);
    Value checked_motion(Value motion, Value depth, Value previous_depth);
    Value validity(Value motion);
    Value reproject(Value motion, Value depth, double scale, Size output_size);
    Value range(Value color, Value history, int scale);
    Value believed(Value range);
    /// hold(image; colour, history) of docs/history.md.
    Value hold(Value image, Value color, Value history, int scale);
    /// The same by a `range` that is known, of whose pixels and `believed` ones spread(value) makes the output's.
    Value hold(Value image, Value history, Value range, const std::function<Value(Value)>& spread);
    Value landed_source(Value motion, Value depth, Value landed_depth, float share);
    Value middle_motion(Value motion, Value depth, Value landed_source);
    Value between(Value middle, Value color, Value previous, double scale);
    Value warp_sharply(Value history, Value motion, Value color, double scale);
    Value residual(Value color, Value past);
    Value trust(Value residual, Value motion, double scale);
    Value collect(Value color, Value past, Value trust, Value motion, double scale);
    Value warp(Value image, Value block_motion, int motion_block, Border border, Value fallback, int fallback_scale,
               std::string name = "warp");
    /// With one vector a pixel and fallback 0.
    Value warp(Value image, Value motion, Border border, std::string name);
    Value tiles(Value image, int scale);
    Value zero_upsample(Value image, int scale);
    Value max_pool(Value image, std::string name);
    Value pick(Value image, int scale, std::string name);
    Value place(Value image, Value samples, int scale, std::string name);
    Value average_pool(Value image, int scale, std::string name);
    Value sharpen(Value image, float amount, std::string name);
    Value offset_mask(Value offsets, std::string name);
    Value project(Value color, Value offsets, Value mask, Value interpolated, int scale, std::string name);
    Value mlaa(Value image, std::string name);
    Value radiance(Value color, double white);
    Value display(Value radiance, double white);
    Value nss_guide(Value depth, Value motion);
    Value nss_flicker(Value radiance, Value guide, Value derivative);
    Value nss_input(Value radiance, Value guide, Value flicker, Value history, Value temporal);
    Value nss_resolve(Value radiance, Value guide, Value kernels, Value temporal, Value history);
    Value space_to_depth(Value image, int scale);
    Value depth_to_space(Value image, int scale);
    Value concat(std::vector<Value> inputs, std::string name = {});
    Value slice(Value image, int first, int count);
    Value convolution(Value image, Parameters weights, Activation activation, std::string name);
    /// Of which only the top left part is wanted.
    Value convolution(Value image, Parameters weights, Activation activation, std::string name, Size part);
    Value sigmoid(Value image, std::string name);
    Value mix(Value where_one, Value where_zero, Value weight, std::string name);
    Value clamp(Value image, float low, float high, std::string name);
    Value round(Value image, std::string name);
    Value tanh(Value image, std::string name);
    /// `slopes`: one a channel.
    Value prelu(Value image, std::vector<float> slopes, std::string name);
    /// Where one of two has one channel, it serves every channel of the other.
    Value sum(Value a, Value b, std::string name);
    Value difference(Value a, Value b, std::string name);
    Value product(Value a, Value b, std::string name);
    /// addend + Σ coefficients[i] · images[i]
    Value linear(std::vector<Value> images, std::vector<float> coefficients, float addend, std::string name);
    /// Over each of so many groups of consecutive channels: the last two leave one channel of each.
    Value softmax(Value image, int groups, std::string name);
    Value channel_maximum(Value image, int groups, std::string name);
    Value channel_sum(Value image, int groups, std::string name);
    /// The image made larger by repeating its last column to the right and its last row below; itself where it has
    /// that size.
    Value replicate_to(Value image, Size size);

  private:
    Value pointwise(Step::Function function, Value a, Value b, std::string name);
    Value across_channels(Step::Function function, Value image, int groups, int channels, std::string name);
    Value add(Operator op, std::vector<Value> inputs, Shape shape, std::string name);
};

/// Floating-point operations (multiply and add are two) of a node's plain definition.
double operations(const Graph& graph, const Node& node);

/// The rows of input `position` that rows of the node's result are made of, within the input. Only of an operator that
/// does not read any rows.
Rows rows_read(const Graph& graph, const Node& node, size_t position, Rows rows);

/// Which pixels of a value are stored. Views hand on what they show.
Pixels stored_pixels(const Graph& graph, Value value);

}  // namespace clarus::graph
