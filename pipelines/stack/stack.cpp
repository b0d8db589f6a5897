#include <algorithm>
#include <array>
#include <initializer_list>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/error.h"
#include "base/rounding.h"
#include "io/json_reader.h"
#include "pipelines/history.h"
#include "pipelines/layer.h"
#include "pipelines/pipeline.h"
#include "pipelines/stack/flow.h"

// A network of plain layers, told by its model file (pipelines/stack/README.md).
namespace clarus::pipelines {
namespace {

using graph::Activation;
using graph::Filter;
using graph::Graph;
using graph::Parameters;
using graph::Resource;
using graph::Shape;
using graph::Shift;
using graph::Value;
using io::JsonNode;

constexpr int kMostChannels = 1 << 12, kLargestKernel = 31, kLargestScale = 8, kMostShrunk = 8,
              kLargestGrowth = kLargestScale * kMostShrunk;
constexpr int kInput = -1;  // in the place of a layer's number
constexpr size_t kMostLayers = 1 << 10;
constexpr double kLargestBound = 1e30;    // of a clamp
constexpr double kMostWeights = 1 << 26;  // of all layers together: several may have the same tensor

/// How far a transposed convolution's taps are from the input pixel that an output pixel lies in.
int reach(int size, int stride, int padding) {
    return std::max((stride - 1 + padding) / stride, (size - 1 - padding) / stride);
}

/// The transposed convolution with these weights [in][out / groups][size][size] as a convolution whose result is to
/// go from depth to space: pixel s·q + r takes input q + d by the tap r + padding − s·d.
Parameters transposed(const std::vector<float>& weights, const std::vector<float>& biases, int in, int out, int groups,
                      int size, int stride, int padding) {
    const int radius = reach(size, stride, padding);
    const int group_in = in / groups, group_out = out / groups;
    Parameters result{out * stride * stride, in};
    result.kernel = 2 * radius + 1;
    result.groups = groups;
    result.weights.reserve(result.weights_per_set());
    for (int channel = 0; channel < result.out_channels; ++channel) {
        const int o = channel / (stride * stride), row = channel / stride % stride, column = channel % stride;
        result.biases.push_back(biases[o]);
        for (int i = 0; i < group_in; ++i) {
            const size_t source = static_cast<size_t>(o / group_out * group_in + i) * group_out + o % group_out;
            for (int dy = -radius; dy <= radius; ++dy) {
                for (int dx = -radius; dx <= radius; ++dx) {
                    const int y = row + padding - stride * dy, x = column + padding - stride * dx;
                    const bool is_tap = y >= 0 && y < size && x >= 0 && x < size;
                    result.weights.push_back(is_tap ? weights[(source * size + y) * size + x] : 0);
                }
            }
        }
    }
    return result;
}

class Builder {
  public:
    Builder(const io::Safetensors& model, int scale, Size render)
        : model_(model),
          where_(model.path().string() + ", metadata \"layers\""),
          scale_(scale),
          render_(render),
          is_luma_(reads_luma(model)),
          is_held_(asks_to_be_held(model)),
          color_(graph_.input(Resource::color, render)),
          seen_(is_luma_ ? luma(color_, "luma") : color_),
          flow_(graph_, seen_) {}

    Graph build() && {
        const nlohmann::json document = io::parse_json(model_.require_metadata("layers"), where_);
        const JsonNode list(document, where_);
        const std::vector<JsonNode> layers = list.items();
        if (layers.size() > kMostLayers) list.refuse("a list of at most " + std::to_string(kMostLayers) + " layers");
        find_kept(layers);
        keep(kInput);
        for (size_t i = 0; i < layers.size(); ++i) {
            number_ = static_cast<int>(i);
            if (const auto of = layers[i].find("of")) flow_ = earlier(*of);
            // A rectifier after a convolution is a part of it, unless the convolution is read elsewhere, too.
            const bool relu_follows = i + 1 < layers.size() && layers[i + 1]["type"].text() == "relu" &&
                                      !layers[i + 1].find("channels") && !layers[i + 1].find("of") &&
                                      !kept_numbers_.contains(number_);
            if (add(layers[i], relu_follows)) expect_keys(layers[++i], {});
            keep(static_cast<int>(i));
        }
        finish();
        return std::move(graph_);
    }

  private:
    static bool reads_luma(const io::Safetensors& model) {
        const auto found = model.metadata().find("network_color");
        if (found == model.metadata().end() || found->second == "rgb") return false;
        if (found->second == "luma") return true;
        fail(ErrorKind::file, "{}: the metadata \"network_color\" must be rgb or luma, not \"{}\"",
             model.path().string(), found->second);
    }

    /// Which layers others than the next one read.
    void find_kept(const std::vector<JsonNode>& layers) {
        for (int i = 0; i < static_cast<int>(layers.size()); ++i) {
            const auto note = [&](const JsonNode& number) {
                kept_numbers_.insert(static_cast<int>(number.integer(kInput, i - 1)));
            };
            if (const auto of = layers[i].find("of")) note(*of);
            if (const auto with = layers[i].find("with")) {
                if (layers[i]["type"].text() == "concatenate")
                    for (const JsonNode& each : with->items()) note(each);
                else
                    note(*with);
            }
        }
    }

    void keep(int number) {
        if (!kept_numbers_.contains(number)) return;
        flow_.whole();  // once for all who read it
        kept_.emplace(number, flow_);
    }

    /// What a layer before this one left, by its number.
    const Flow& earlier(const JsonNode& number) const {
        return kept_.at(static_cast<int>(number.integer(kInput, number_ - 1)));
    }

    std::string name(std::string_view kind) const { return std::string(kind) + " " + std::to_string(number_); }

    Value luma(Value color, std::string name) {
        return graph_.linear({graph_.slice(color, 0, 1), graph_.slice(color, 1, 1), graph_.slice(color, 2, 1)},
                             {0.299f, 0.587f, 0.114f}, 0, std::move(name));
    }

    /// Refuses keys that a layer of this type does not have.
    static void expect_keys(const JsonNode& layer, std::initializer_list<std::string_view> keys) {
        for (const auto& [key, value] : layer.members()) {
            if (key == "type" || key == "of" || std::find(keys.begin(), keys.end(), key) != keys.end()) continue;
            std::string known = "type, of";
            for (const std::string_view each : keys) known += ", " + std::string(each);
            value.refuse("left out; a layer of this type has the fields " + known);
        }
    }

    static int integer_or(const JsonNode& layer, const std::string& key, int low, int high, int otherwise) {
        const auto value = layer.find(key);
        return value ? static_cast<int>(value->integer(low, high)) : otherwise;
    }

    /// How many groups of so many channels each.
    int groups_of(const JsonNode& layer, int channels) const {
        const int groups = integer_or(layer, "groups", 1, channels, 1);
        if (channels % groups != 0)
            layer["groups"].refuse("a divisor of the " + std::to_string(channels) + " channels there are");
        return groups;
    }

    std::vector<float> biases(const std::string& tensor, int count) const {
        if (!model_.has(tensor + ".bias")) return std::vector<float>(count);
        return finite_floats(model_, model_.require(tensor + ".bias", std::array<int64_t, 1>{count}));
    }

    int out_channels(const std::string& tensor, int64_t extent, int groups) const {
        if (extent < 1 || extent > kMostChannels || extent % groups != 0)
            fail(ErrorKind::file, "{}: tensor {} makes {} channels; from 1 to {} in {} equal groups are possible",
                 model_.path().string(), tensor, extent, kMostChannels, groups);
        return static_cast<int>(extent);
    }

    /// Before they are read.
    void count_weights(double out, double in, double taps) {
        weights_ += out * in * taps;
        if (weights_ > kMostWeights)
            fail(ErrorKind::file, "{}: layers up to {} have more than {:.0f} weights in all", where_.string(), number_,
                 kMostWeights);
    }

    void convolution(const JsonNode& layer, bool relu) {
        expect_keys(layer, {"tensor", "size", "stride", "groups"});
        const std::string tensor = layer["tensor"].text();
        const int in = flow_.channels();
        Parameters parameters{0, in};
        parameters.kernel = static_cast<int>(layer["size"].integer(1, kLargestKernel));
        if (parameters.kernel % 2 == 0) layer["size"].refuse("odd");
        parameters.groups = groups_of(layer, in);
        parameters.stride = integer_or(layer, "stride", 1, kLargestScale, 1);
        const int64_t size = parameters.kernel;
        const io::Tensor& weights =
            model_.require(tensor + ".weight", std::array<int64_t, 4>{-1, in / parameters.groups, size, size});
        parameters.out_channels = out_channels(tensor + ".weight", weights.shape[0], parameters.groups);
        count_weights(parameters.out_channels, in / parameters.groups, parameters.taps());
        if (model_.has(tensor + ".bias") || is_quantized(model_, tensor)) {
            read_weights(model_, tensor, parameters);
        } else {
            parameters.layer = tensor;
            parameters.weights = finite_floats(model_, weights);
            parameters.biases.resize(parameters.out_channels);
        }
        flow_.shrunk *= parameters.stride;
        if (kMostShrunk % flow_.shrunk != 0)
            layer["stride"].refuse("one by which the image is shrunk by a divisor of " + std::to_string(kMostShrunk) +
                                   " in all");
        flow_.replace(graph_.convolution(flow_.whole(), std::move(parameters),
                                         relu ? Activation::relu : Activation::none, name("convolution")));
    }

    Parameters float_transposed(const std::string& tensor, int in, int groups, int size, int stride, int padding) {
        const io::Tensor& weights = model_.require(tensor + ".weight", std::array<int64_t, 4>{in, -1, size, size});
        const int out = out_channels(tensor + ".weight", weights.shape[1] * groups, groups);
        const double side = 2 * reach(size, stride, padding) + 1;
        count_weights(double(out) * stride * stride, in / groups, side * side);
        Parameters result =
            transposed(finite_floats(model_, weights), biases(tensor, out), in, out, groups, size, stride, padding);
        result.layer = tensor;
        return result;
    }

    /// Which a model has as it is computed.
    Parameters quantized_transposed(const std::string& tensor, int in, int groups, int radius, int stride) {
        const int size = 2 * radius + 1;
        const io::Tensor& weights =
            model_.require(tensor + ".weight", std::array<int64_t, 4>{-1, in / groups, size, size});
        Parameters result{out_channels(tensor + ".weight", weights.shape[0], groups * stride * stride), in};
        result.kernel = size;
        result.groups = groups;
        count_weights(result.out_channels, in / groups, result.taps());
        read_weights(model_, tensor, result);
        return result;
    }

    void transposed_convolution(const JsonNode& layer, bool relu) {
        expect_keys(layer, {"tensor", "size", "stride", "groups", "padding"});
        const std::string tensor = layer["tensor"].text();
        const int in = flow_.channels();
        const int size = static_cast<int>(layer["size"].integer(1, kLargestKernel)), groups = groups_of(layer, in);
        const int stride = static_cast<int>(layer["stride"].integer(1, kLargestScale));
        const int padding = integer_or(layer, "padding", 0, size - 1, (size - 1) / 2);
        const int output_padding = stride + 2 * padding - size;
        if (output_padding < 0 || output_padding >= stride)
            fail(ErrorKind::file,
                 "{}: layer {} does not make images {} times as large: with size {} the padding must be such that "
                 "stride + 2 padding - size is from 0 to {}, but it is {}",
                 where_.string(), number_, stride, size, stride - 1, output_padding);
        Parameters parameters = is_quantized(model_, tensor)
                                    ? quantized_transposed(tensor, in, groups, reach(size, stride, padding), stride)
                                    : float_transposed(tensor, in, groups, size, stride, padding);
        const Value result = graph_.convolution(flow_.whole(), std::move(parameters),
                                                relu ? Activation::relu : Activation::none, name("convolution"));
        grow(stride, result);
    }

    void count_growth(int scale) {
        flow_.grown *= scale;
        if (flow_.grown > kLargestGrowth)
            fail(ErrorKind::file, "{}: layers make the image more than {} times as large", where_.string(),
                 kLargestGrowth);
    }

    void grow(int scale, Value image) {
        count_growth(scale);
        flow_.replace(scale > 1 ? graph_.depth_to_space(image, scale) : image);
    }

    /// Which channels a layer is for: all of them unless it says so.
    std::pair<int, int> range_of(const JsonNode& layer) const {
        const int channels = flow_.channels();
        const auto range = layer.find("channels");
        if (!range) return {0, channels};
        const std::vector<JsonNode> numbers = range->items(2);
        const int first = static_cast<int>(numbers[0].integer(0, channels - 1));
        return {first, static_cast<int>(numbers[1].integer(1, channels - first))};
    }

    void prelu(const JsonNode& layer) {
        expect_keys(layer, {"tensor"});
        const std::string tensor = layer["tensor"].text() + ".weight";
        const int channels = flow_.channels();
        const io::Tensor& slopes = model_.require(tensor, std::array<int64_t, 1>{-1});
        if (slopes.shape[0] != 1) model_.require(tensor, std::array<int64_t, 1>{channels});
        std::vector<float> values = finite_floats(model_, slopes);
        values.resize(channels, values.front());
        flow_.replace(graph_.prelu(flow_.whole(), std::move(values), name("prelu")));
    }

    void product(const JsonNode& layer) {
        expect_keys(layer, {"channels"});
        const auto [first, count] = range_of(layer);
        if (count % 2 != 0)
            fail(ErrorKind::file, "{}: layer {} is the product of halves, of {} channels", where_.string(), number_,
                 count);
        const int half = count / 2;
        const Value result =
            graph_.product(flow_.channels(first, half), flow_.channels(first + half, half), name("product"));
        flow_.replace(first, count, result);
    }

    void residual(const JsonNode& layer) {
        expect_keys(layer, {"filter"});
        const Filter filter = layer["filter"].choice<Filter>({{"nearest", Filter::nearest},
                                                              {"bilinear", Filter::bilinear},
                                                              {"bicubic", Filter::bicubic},
                                                              {"lanczos", Filter::lanczos}});
        const Shape added{graph_.shape(seen_).channels, flow_.grown * ceil_divide(render_.height, flow_.shrunk),
                          flow_.grown * ceil_divide(render_.width, flow_.shrunk)};
        if (flow_.channels() != added.channels || flow_.grown % flow_.shrunk != 0)
            fail(
                ErrorKind::file,
                "{}: layer {} adds the {} channels of the input, made a whole number of times as large, to {} channels "
                "of {}/{} of its size",
                where_.string(), number_, added.channels, flow_.channels(), flow_.grown, flow_.shrunk);
        const Value upsampled = flow_.grown == flow_.shrunk ? seen_
                                                            : graph_.resample(seen_, filter, flow_.grown / flow_.shrunk,
                                                                              {added.width, added.height}, Shift::none);
        require_whole_size();
        flow_.replace(graph_.sum(flow_.whole(), upsampled, name("residual")));
    }

    /// What is put together with the flow: as large, and where strides have shrunk them, still of one size.
    const Flow& partner(const JsonNode& number) {
        const Flow& other = earlier(number);
        if (!flow_.is_as_large_as(other))
            number.refuse(
                fmt::format("a layer whose image is as large as this one, {}/{} of the input's size; it is "
                            "{}/{} of it",
                            flow_.grown, flow_.shrunk, other.grown, other.shrunk));
        flow_.take_size(other);
        require_whole_size();
        return other;
    }

    void together(const JsonNode& layer, const std::string& type) {
        expect_keys(layer, {"with"});
        Flow other = partner(layer["with"]);
        const int channels = flow_.channels(), others = other.channels();
        if (channels != others && channels != 1 && others != 1)
            layer["with"].refuse(fmt::format("a layer of {} channels, or of one; it has {}", channels, others));
        flow_.replace(type == "add" ? graph_.sum(flow_.whole(), other.whole(), name(type))
                                    : graph_.product(flow_.whole(), other.whole(), name(type)));
    }

    void concatenate(const JsonNode& layer) {
        expect_keys(layer, {"with"});
        for (const JsonNode& number : layer["with"].items()) {
            flow_.append(partner(number));
            if (flow_.channels() > kMostChannels)
                number.refuse(fmt::format("one that makes no more than {} channels in all", kMostChannels));
        }
    }

    void slice(const JsonNode& layer) {
        expect_keys(layer, {"channels"});
        const auto [first, count] = range_of(layer);
        flow_.replace(flow_.channels(first, count));
    }

    void clamp(const JsonNode& layer) {
        expect_keys(layer, {"low", "high"});
        const auto low = static_cast<float>(layer["low"].number(-kLargestBound, kLargestBound));
        const auto high = static_cast<float>(layer["high"].number(low, kLargestBound));
        flow_.replace(graph_.clamp(flow_.whole(), low, high, name("clamp")));
    }

    void upsample(const JsonNode& layer) {
        expect_keys(layer, {"scale"});
        const int scale = static_cast<int>(layer["scale"].integer(2, kLargestScale));
        const Value image = flow_.whole();
        count_growth(scale);
        flow_.replace(graph_.upsample(image, scale, Shift::none, name("upsample")));
    }

    /// Adds a layer; whether it was the rectifier after it, too.
    bool add(const JsonNode& layer, bool relu_follows) {
        const std::string type = layer["type"].text();
        if (type == "convolution") {
            convolution(layer, relu_follows);
            return relu_follows;
        }
        if (type == "transposed_convolution") {
            transposed_convolution(layer, relu_follows);
            return relu_follows;
        }
        if (type == "prelu") {
            prelu(layer);
        } else if (type == "product") {
            product(layer);
        } else if (type == "residual") {
            residual(layer);
        } else if (type == "add" || type == "multiply") {
            together(layer, type);
        } else if (type == "concatenate") {
            concatenate(layer);
        } else if (type == "slice") {
            slice(layer);
        } else if (type == "clamp") {
            clamp(layer);
        } else if (type == "upsample") {
            upsample(layer);
        } else if (type == "depth_to_space") {
            expect_keys(layer, {"scale"});
            const int scale = static_cast<int>(layer["scale"].integer(2, kLargestScale));
            if (flow_.channels() % (scale * scale) != 0)
                layer["scale"].refuse("one whose square divides the " + std::to_string(flow_.channels()) +
                                      " channels there are");
            grow(scale, flow_.whole());
        } else if (type == "relu" || type == "tanh" || type == "sigmoid" || type == "softmax") {
            across(layer, type);
        } else if (type == "maximum" || type == "sum") {
            expect_keys(layer, {"groups"});
            const int groups = groups_of(layer, flow_.channels());
            flow_.replace(type == "sum" ? graph_.channel_sum(flow_.whole(), groups, name("sum"))
                                        : graph_.channel_maximum(flow_.whole(), groups, name("maximum")));
        } else {
            layer["type"].refuse(
                "one of convolution, transposed_convolution, prelu, relu, tanh, sigmoid, softmax, maximum, sum, "
                "product, add, multiply, concatenate, slice, clamp, depth_to_space, upsample, residual");
        }
        return false;
    }

    /// What leaves as many channels as there are.
    void across(const JsonNode& layer, const std::string& type) {
        if (type == "softmax")
            expect_keys(layer, {"channels", "groups"});
        else
            expect_keys(layer, {"channels"});
        const auto [first, count] = range_of(layer);
        const Value part = flow_.channels(first, count);
        Value result = part;
        if (type == "relu") result = graph_.prelu(part, std::vector<float>(count), name(type));
        if (type == "tanh") result = graph_.tanh(part, name(type));
        if (type == "sigmoid") result = graph_.sigmoid(part, name(type));
        if (type == "softmax") result = graph_.softmax(part, groups_of(layer, count), name(type));
        flow_.replace(first, count, result);
    }

    /// Where strides have not divided the image, there is more of it now than there should be.
    void require_whole_size() const {
        if (render_.width % flow_.shrunk != 0 || render_.height % flow_.shrunk != 0)
            fail(ErrorKind::invalid_argument, "{}: its strides want sides that are multiples of {}, not {}x{}",
                 model_.path().string(), flow_.shrunk, render_.width, render_.height);
    }

    void finish() {
        const int channels = is_luma_ ? 1 : 3;
        if (flow_.channels() != channels || flow_.grown != scale_ * flow_.shrunk)
            fail(ErrorKind::file,
                 "{}: the last layer leaves {} channels of {}/{} of the input's size; {} of {} are wanted",
                 where_.string(), flow_.channels(), flow_.grown, flow_.shrunk, channels, scale_);
        require_whole_size();
        Value result = flow_.whole();
        if (is_luma_) {
            // The other two channels of YCbCr are interpolated: what the luma gains, red, green and blue do.
            const Value upsampled = graph_.resample(color_, Filter::bicubic, scale_,
                                                    {scale_ * render_.width, scale_ * render_.height}, Shift::none);
            const Value gain = graph_.linear({result, luma(upsampled, "luma")}, {1, -1}, 0, "luma gain");
            result = graph_.sum(upsampled, gain, "color");
        }
        graph_.output = is_held_ ? held(result) : graph_.clamp(result, 0, 1, "clamp");
        graph_.views = {{"input_color", color_}, {"output", graph_.output}};
    }

    /// Within what the frame shows: its own upsampling stands for the history that there is none of.
    Value held(Value result) {
        const Size output{scale_ * render_.width, scale_ * render_.height};
        const Value upsampled = graph_.resample(color_, Filter::bilinear, scale_, output, Shift::none);
        return graph_.hold(result, color_, upsampled, scale_);
    }

    static bool asks_to_be_held(const io::Safetensors& model) {
        const HistoryOptions options = history_options(model);
        if (options.checked)
            fail(ErrorKind::file, R"({}: metadata `history` is "checked", but a stack of layers has no history)",
                 model.path().string());
        return options.held;
    }

    const io::Safetensors& model_;
    const std::filesystem::path where_;  // for messages
    const int scale_;
    const Size render_;
    const bool is_luma_, is_held_;
    Graph graph_;
    const Value color_;
    const Value seen_;  // by the network
    Flow flow_;
    std::set<int> kept_numbers_;  // of layers that others than the next one read
    std::map<int, Flow> kept_;    // those of them that have been added
    int number_ = 0;              // of the layer
    double weights_ = 0;
};

}  // namespace

graph::Graph build_stack(const io::Safetensors& model, int scale, Size render, const PipelineOptions&) {
    return Builder(model, scale, render).build();
}

}  // namespace clarus::pipelines
