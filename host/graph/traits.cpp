#include "graph/traits.h"

#include <algorithm>
#include <stdexcept>

#include "base/rounding.h"
#include "graph/graph.h"

namespace clarus::graph {
namespace {

Rows upsampled(Rows rows, int scale, Shift shift) {
    const int jitter = shift == Shift::none ? 0 : 1;
    return {rows.first / scale - 1 - jitter, (rows.end - 1) / scale + 2 + jitter};
}

Rows pooled(Rows rows) { return {2 * rows.first, 2 * rows.end}; }

const Convolution& convolution_of(const Node& node) { return std::get<Convolution>(node.op); }

}  // namespace

Rows same_rows(const Graph&, const Node&, size_t, Rows rows) { return rows; }

Rows rows_of_pooling(const Graph&, const Node&, size_t, Rows rows) { return pooled(rows); }

Rows rows_of_upsampling(const Graph&, const Node& node, size_t, Rows rows) {
    const auto& upsample = std::get<Upsample>(node.op);
    return upsampled(rows, upsample.scale, upsample.shift);
}

Rows rows_of_squares(const Graph&, const Node& node, size_t, Rows rows) {
    const int scale = traits(node.op).placement.scale;
    return {rows.first / scale, ceil_divide(rows.end, scale)};
}

Rows rows_of_convolution(const Graph& graph, const Node& node, size_t position, Rows rows) {
    const Convolution& convolution = convolution_of(node);
    const Parameters& parameters = *graph.parameters[convolution.parameters];
    const int reach = parameters.kernel / 2;
    rows = {parameters.stride * rows.first - reach, parameters.stride * (rows.end - 1) + reach + 1};
    if (convolution.readings.empty()) return rows;
    rows = {std::max(rows.first, 0), std::min(rows.end, convolution.height)};
    switch (convolution.readings[position]) {
        case Reading::whole:
        case Reading::factor:
            return rows;
        case Reading::pooled:
            return pooled(rows);
        case Reading::upsampled:
            return upsampled(rows, 2, Shift::none);
    }
    throw std::logic_error("unknown reading");
}

Rows rows_read(const Graph& graph, const Node& node, size_t position, Rows rows) {
    rows = traits(node.op).rows(graph, node, position, rows);
    const int height = graph.shape(node.inputs[position]).height;
    return {std::clamp(rows.first, 0, height - 1), std::clamp(rows.end, 1, height)};
}

double Cost::of(const Graph& graph, const Node& node) const {
    return of_all_ ? of_all_(graph, node) : an_element_ * static_cast<double>(node.shape.elements());
}

double operations_of_convolution(const Graph& graph, const Node& node) {
    const Parameters& parameters = *graph.parameters[convolution_of(node).parameters];
    return 2.0 * parameters.taps() * parameters.in_channels / parameters.groups *
           static_cast<double>(node.shape.elements());
}

double operations_of_fit(const Graph& graph, const Node& node) {
    const Shape &in = graph.shape(node.inputs[0]), &out = node.shape;
    // Of each tap a product, a sum and two comparisons.
    const auto of_axis = [](int from, int to) { return 4.0 * (to > from ? 4 : ceil_divide(from, to)); };
    const double along_y = static_cast<double>(out.channels) * out.height * in.width * of_axis(in.height, out.height);
    return along_y + static_cast<double>(out.elements()) * of_axis(in.width, out.width);
}

double operations_an_element(Filter filter) {
    switch (filter) {
        case Filter::nearest:
            return 0;
        case Filter::bilinear:
            return 7;
        case Filter::bicubic:
            return 31;
        case Filter::lanczos:
            return 71;
    }
    throw std::logic_error("unknown filter");
}

double operations(const Graph& graph, const Node& node) { return traits(node.op).cost.of(graph, node); }

bool aliases_memory(const Operator& op) {
    const Memory memory = traits(op).memory;
    return memory == Memory::aliases || memory == Memory::previous;
}

bool is_view(const Operator& op) { return aliases_memory(op) || traits(op).memory == Memory::gathers; }

bool is_in_place(const Operator& op) { return traits(op).memory == Memory::in_place; }

Pixels stored_pixels(const Graph& graph, Value value) {
    const Node& node = graph.nodes[value];
    const Traits known = traits(node.op);
    if (known.memory == Memory::previous) {
        const auto state = std::find_if(graph.states.begin(), graph.states.end(),
                                        [&](const State& each) { return each.previous == value; });
        return state == graph.states.end() ? Pixels::all : stored_pixels(graph, state->next);
    }
    if (known.memory != Memory::aliases) return Pixels::all;
    if (known.placement.pixels != Pixels::all) return known.placement.pixels;
    // What it cannot read is copied, and stored whole, before.
    const Pixels shown = stored_pixels(graph, node.inputs[0]);
    return shown <= known.reads ? shown : Pixels::all;
}

}  // namespace clarus::graph
