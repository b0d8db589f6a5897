#include "graph/traits.h"

#include <doctest/doctest.h>

#include <cstddef>
#include <utility>
#include <variant>

#include "graph/graph.h"
#include "runtime/implementation.h"
#include "zero_parameters.h"

using namespace clarus;
using namespace clarus::graph;

namespace {

struct WithoutTraits {};
struct OfAnotherType {
    int traits() const { return 0; }
};
static_assert(!HasTraits<WithoutTraits> && !HasTraits<OfAnotherType>);

/// Calls f(Op{}) for every operator there is.
template <typename F>
void for_each_operator(F f) {
    [&]<size_t... i>(std::index_sequence<i...>) {
        static_assert((HasTraits<std::variant_alternative_t<i, Operator>> && ...));
        (f(std::variant_alternative_t<i, Operator>{}), ...);
    }
    (std::make_index_sequence<std::variant_size_v<Operator>>());
}

/// Fit for every operator's traits: scales must not be 0.
template <typename Op>
Node node_of(Op op) {
    if constexpr (requires { op.scale; }) op.scale = 2;
    return {op, {}, {1, 1, 1}, ""};
}

}  // namespace

TEST_SUITE("small") {
    TEST_CASE("what its traits say a kernel writes has kernels, and nothing else has") {
        for_each_operator([](const auto& op) {
            const Node node = node_of(op);
            const Memory memory = traits(node.op).memory;
            CAPTURE(node.op.index());
            CHECK(runtime::implementations(node).empty() == (memory != Memory::own && memory != Memory::in_place));
        });
    }

    TEST_CASE("what shares memory is stored as that is") {
        for_each_operator([](const auto& op) {
            const Node node = node_of(op);
            CAPTURE(node.op.index());
            CHECK(aliases_memory(node.op) == (traits(node.op).stored == Stored::as_input));
            CHECK((!aliases_memory(node.op) || is_view(node.op)));
        });
        CHECK_FALSE(aliases_memory(Concat{}));
        CHECK(is_view(Concat{}));
        CHECK(is_in_place(Place{2}));
        CHECK(traits(Input{Resource::depth}).stored == Stored::f32);
        CHECK(traits(Input{Resource::color}).stored == Stored::image);
    }

    TEST_CASE("costs are those of the plain definition, counted by hand") {
        Graph graph;
        const Value color = graph.input(Resource::color, {16, 8}), depth = graph.input(Resource::depth, {16, 8}),
                    motion = graph.input(Resource::motion, {16, 8});
        const auto cost = [&](Value value) { return operations(graph, graph.nodes[value]); };
        CHECK(cost(color) == 0);

        Parameters grouped = zero_parameters(8, 4);
        grouped.groups = 2;
        grouped.weights.resize(grouped.weights_per_set());
        const Value four = graph.convolution(color, zero_parameters(4, 3), Activation::relu, "four");
        CHECK(cost(four) == 2 * 9 * 3 * 4 * (16 * 8));
        CHECK(cost(graph.convolution(four, grouped, Activation::relu, "groups")) == 2 * 9 * 2 * 8 * (16 * 8));

        // Of 16 pixels under each of 4 × 2 blocks the nearest (15 comparisons), its vector times the scale (2
        // products).
        CHECK(cost(graph.dilate(motion, depth, 2)) == 17 * (4 * 2));
        // Of 9 pixels under each of 6 × 3 blocks.
        CHECK(cost(graph.dilate(motion, depth, 3)) == 10 * (6 * 3));
        // Shift 4, inside the image 4, fractions 4; 4 weights of 1 - fraction (2) and a product each; weight and depth
        // compared four times.
        const Value before = graph.previous_depth(motion, depth);
        CHECK(cost(before) == (12 + 6 + 8) * (16 * 8));
        CHECK(cost(graph.nodes[before].inputs[0]) == 0);  // the plane of ones
        CHECK(cost(graph.validity(motion)) == 2 * (16 * 8));
        // Nine neighbours' two differences and comparisons; four pixels' weight twice, depth, nine and 25 neighbours.
        CHECK(cost(graph.checked_motion(motion, depth, before)) == (9 * 4 + 4 * (9 + 25) + 34 + 18) * (16 * 8));
        // Two axes' differences of depth and comparison, of vectors; the area; its root and the product.
        CHECK(cost(graph.depth_before(motion, depth)) == (10 + 8 + 5 + 11) * (16 * 8));
        // Four neighbours' differences and comparisons, three channels.
        CHECK(cost(graph.mlaa(color, "mlaa")) == 4 * 2 * 3 * (16 * 8));
        CHECK(cost(graph.slice(color, 0, 2)) == 0);
        CHECK(cost(graph.average_pool(color, 4, "pool")) == 16 * 3 * (4 * 2));
        CHECK(cost(graph.resample(color, Filter::bilinear, 2, {32, 16})) == 7 * 3 * (32 * 16));
    }

    TEST_CASE("rows that are read follow strides, scales and borders") {
        Graph graph;
        const Value image = graph.input(Resource::color, {6, 20});
        const auto read = [&](Value value, int first, int end) {
            const Rows rows = rows_read(graph, graph.nodes[value], 0, {first, end});
            return std::pair(rows.first, rows.end);
        };
        Parameters halving = zero_parameters(4, 3);
        halving.stride = 2;
        halving.kernel = 5;
        halving.weights.resize(halving.weights_per_set());
        CHECK(read(graph.convolution(image, halving, Activation::none, "half"), 3, 5) == std::pair(4, 11));
        CHECK(read(graph.convolution(image, halving, Activation::none, "half"), 0, 10) == std::pair(0, 20));
        CHECK(read(graph.max_pool(image, "pool"), 3, 5) == std::pair(6, 10));
        CHECK(read(graph.upsample(image, 3, Shift::none, "up"), 9, 12) == std::pair(2, 5));
        CHECK(read(graph.upsample(image, 3, Shift::jitter, "up"), 9, 12) == std::pair(1, 6));
        CHECK(read(graph.zero_upsample(image, 3), 8, 13) == std::pair(2, 5));
        CHECK(read(graph.clamp(image, 0, 1, "clamp"), 8, 13) == std::pair(8, 13));
        CHECK((traits(graph.nodes[graph.mlaa(image, "mlaa")].op).rows == kAnyRows));
    }

    TEST_CASE("views hand on which pixels are stored, also of the frame before") {
        Graph graph;
        const Value color = graph.input(Resource::color, {4, 4});
        const Value samples = graph.zero_upsample(color, 2), tiles = graph.tiles(color, 2);
        const Value before = graph.previous({3, 8, 8}, "before");
        graph.carry(before, graph.slice(samples, 0, 3));
        CHECK(stored_pixels(graph, color) == Pixels::all);
        CHECK(stored_pixels(graph, samples) == Pixels::samples);
        CHECK(stored_pixels(graph, graph.slice(samples, 1, 1)) == Pixels::samples);
        CHECK(stored_pixels(graph, graph.slice(tiles, 1, 1)) == Pixels::tiles);
        CHECK(stored_pixels(graph, before) == Pixels::samples);
        CHECK(stored_pixels(graph, graph.clamp(samples, 0, 1, "clamp")) == Pixels::all);
    }
}
