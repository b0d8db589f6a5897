#include <algorithm>
#include <memory>
#include <optional>
#include <utility>

#include "graph/passes.h"
#include "graph/uses.h"

namespace clarus::graph {
namespace {

// As many as kernels/convolution_input.clh counts.
constexpr size_t kMostParts = 8;
// Channels are read by so many at once.
constexpr int kQuad = 4;

template <typename Op>
bool is(const Node& node) {
    return std::holds_alternative<Op>(node.op);
}

/// One of the images that an input is made of, and how it is read.
struct Part {
    Value image;
    Reading reading = Reading::whole;
    std::optional<Value> factor = {};
    int first = 0;  // of the input's channels
};

class Inputs {
  public:
    explicit Inputs(const Graph& graph) : graph_(graph), uses_(graph) {}

    /// Of the convolution's input; empty where nothing is gained, or where the kernels could not read it.
    std::vector<Part> parts(const Node& node) const {
        const auto& convolution = std::get<Convolution>(node.op);
        const Parameters& parameters = *graph_.parameters[convolution.parameters];
        if (parameters.groups != 1 || parameters.stride != 1 || parameters.conditioned) return {};
        const Value input = node.inputs[0];
        const bool joined = is<Concat>(graph_.nodes[input]) && uses_.only_one(input);
        std::vector<Part> result;
        int first = 0;
        for (const Value image : joined ? graph_.nodes[input].inputs : std::vector{input}) {
            result.push_back(part(image));
            result.back().first = first;
            first += graph_.shape(image).channels;
        }
        // Samples last.
        std::stable_partition(result.begin(), result.end(), [&](const Part& each) { return !is_sparse(each.image); });
        return is_gain(result, graph_.shape(input)) && is_readable(result) ? result : std::vector<Part>();
    }

    bool is_sparse(Value value) const { return stored_pixels(graph_, value) == Pixels::samples; }

  private:
    Part part(Value value) const {
        const Node& node = graph_.nodes[value];
        if (!uses_.only_one(value)) return {value};
        const auto* upsample = std::get_if<Upsample>(&node.op);
        if (upsample && upsample->scale == 2 && upsample->shift == Shift::none && is_whole_feature(node.inputs[0]))
            return {node.inputs[0], Reading::upsampled};
        if (is<MaxPool>(node) && is_whole_feature(node.inputs[0])) return {node.inputs[0], Reading::pooled};
        if (const auto* program = std::get_if<Pointwise>(&node.op)) {
            if (program->steps.empty() && node.inputs.size() == 1) {
                // Its image, made larger.
                const Part inner = part(node.inputs[0]);
                return inner.reading == Reading::whole && is_feature(inner.image) ? inner : Part{value};
            }
            if (const auto weighted = product(node, *program)) return *weighted;
        }
        return {value};
    }

    std::optional<Part> product(const Node& node, const Pointwise& program) const {
        const bool only_product = program.steps.size() == 1 && node.inputs.size() == 2 &&
                                  program.steps[0].function == Step::Function::product;
        if (!only_product) return {};
        auto [image, factor] = std::pair(node.inputs[0], node.inputs[1]);
        if (graph_.shape(factor).channels != 1) std::swap(image, factor);
        if (graph_.shape(factor).channels != 1 || !is_whole_feature(image) || !is_whole_feature(factor)) return {};
        return Part{image, Reading::whole, factor};
    }

    /// A feature that is not zero-upsampled.
    bool is_whole_feature(Value value) const { return is_feature(value) && !is_sparse(value); }

    /// What the kernels can read in place; of a view, what it shows must be, and neither in blocks nor in tiles.
    bool is_feature(Value value) const {
        const Node& node = graph_.nodes[value];
        const Traits known = traits(node.op);
        if (known.memory != Memory::aliases) return known.stored == Stored::feature;
        return known.placement.block == 1 && known.placement.pixels != Pixels::tiles && is_feature(node.inputs[0]);
    }

    bool is_gain(const std::vector<Part>& parts, const Shape& input) const {
        return std::any_of(parts.begin(), parts.end(), [&](const Part& part) {
            const Shape& shape = graph_.shape(part.image);
            return part.reading != Reading::whole || part.factor || is_sparse(part.image) ||
                   shape.width != input.width || shape.height != input.height;
        });
    }

    bool is_readable(const std::vector<Part>& parts) const {
        const auto samples = [&](const Part& part) { return is_sparse(part.image); };
        const auto in_quads = [&](const Part& part) { return graph_.shape(part.image).channels % kQuad == 0; };
        return parts.size() <= kMostParts && std::count_if(parts.begin(), parts.end(), samples) <= 1 &&
               std::all_of(parts.begin(), parts.end() - 1, in_quads) &&
               std::all_of(parts.begin(), parts.end(), [&](const Part& part) { return is_feature(part.image); });
    }

    const Graph& graph_;
    Uses uses_;
};

/// Makes input channels [first, first + count) the last, in each of `rows` that `row` begins, where each weight takes
/// `numbers` of them.
template <typename Row>
void put_last(Row row, int rows, const Parameters& parameters, int first, int count, int numbers) {
    const int channel = parameters.taps() * numbers, all = parameters.in_channels * channel;
    for (; rows > 0; --rows, row += all) std::rotate(row + first * channel, row + (first + count) * channel, row + all);
}

/// In the perceptron's last layer, too, where it makes these weights.
void put_last(Graph& graph, int index, int first, int count) {
    const auto moved = std::make_shared<Parameters>(*graph.parameters[index]);
    if (moved->quantized)
        put_last(moved->quantized->weights.begin(), moved->sets * moved->out_channels, *moved, first, count, 1);
    else
        put_last(moved->weights.begin(), moved->sets * moved->out_channels, *moved, first, count, 1);
    graph.parameters[index] = moved;
    const Parameters& parameters = *moved;
    if (!parameters.conditioned || !graph.jitter_kernels || graph.jitter_kernels->predictor.empty()) return;
    DenseLayer& last = graph.jitter_kernels->predictor.back();
    size_t made_before = 0;
    for (const int other : graph.jitter_kernels->conditioned) {
        if (other == index) break;
        made_before += graph.parameters[other]->weights_per_set() + graph.parameters[other]->out_channels;
    }
    const int rows = parameters.out_channels;
    put_last(last.weights.begin() + made_before * last.in, rows, parameters, first, count, last.in);
    put_last(last.biases.begin() + made_before, rows, parameters, first, count, 1);
}

/// A convolution's input that ends with an image in blocks, such as what was warped at output resolution, becomes two
/// images: that one, whose pixels then follow each other without a gap, and what was before it.
void separate_blocks(Graph& graph) {
    const Uses uses(graph);
    for (Node& node : graph.nodes) {
        const auto* convolution = std::get_if<Convolution>(&node.op);
        if (!convolution || !convolution->readings.empty()) continue;
        const Value input = node.inputs[0];
        Node& all = graph.nodes[input];
        if (!is<Concat>(all) || !uses.only_one(input) || all.inputs.size() < 2) continue;
        const Value blocks = all.inputs.back();
        const int count = graph.shape(blocks).channels, first = all.shape.channels - count;
        const Parameters& parameters = *graph.parameters[convolution->parameters];
        const bool plain = parameters.groups == 1 && parameters.stride == 1;
        if (!plain || !is<SpaceToDepth>(graph.nodes[blocks]) || !uses.only_one(blocks) || count % kQuad != 0) continue;
        put_last(graph, convolution->parameters, 0, first);
        all.inputs.pop_back();
        all.shape.channels = first;
        Convolution separate = *convolution;
        separate.readings = {Reading::whole, Reading::whole};
        separate.width = all.shape.width;
        separate.height = all.shape.height;
        node.op = separate;
        node.inputs = {blocks, input};
    }
}

}  // namespace

Graph fuse_convolution_inputs(const Graph& graph) {
    Graph result = graph;
    const Inputs inputs(graph);
    for (Node& node : result.nodes) {
        if (!is<Convolution>(node) || !std::get<Convolution>(node.op).readings.empty()) continue;
        const std::vector<Part> parts = inputs.parts(node);
        if (parts.empty()) continue;
        auto& convolution = std::get<Convolution>(node.op);
        if (inputs.is_sparse(parts.back().image))
            put_last(result, convolution.parameters, parts.back().first, graph.shape(parts.back().image).channels);
        const Shape& shape = graph.shape(node.inputs[0]);
        convolution.width = shape.width;
        convolution.height = shape.height;
        node.inputs.clear();
        for (const Part& part : parts) {
            node.inputs.push_back(part.image);
            convolution.readings.push_back(part.reading);
            if (!part.factor) continue;
            node.inputs.push_back(*part.factor);
            convolution.readings.push_back(Reading::factor);
        }
    }
    result = remove_unused(result);
    separate_blocks(result);
    return result;
}

}  // namespace clarus::graph
