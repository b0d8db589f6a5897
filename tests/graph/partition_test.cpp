#include "graph/partition.h"

#include <doctest/doctest.h>

#include <algorithm>

#include "graph/passes.h"
#include "zero_parameters.h"

using namespace clarus;
using namespace clarus::graph;

namespace {

constexpr Size kSize{6, 4};

Value convolution(Graph& graph, Value image, const char* name) {
    return graph.convolution(image, zero_parameters(3, graph.shape(image).channels), Activation::none, name);
}

std::vector<std::string> names(const Graph& graph) {
    std::vector<std::string> result;
    for (const Node& node : graph.nodes)
        if (std::holds_alternative<Convolution>(node.op)) result.push_back(node.name);
    return result;
}

/// a → b → c → d, and a → d. The history is what c made; a and d read it.
struct Chain {
    Chain() {
        const Value color = graph.input(Resource::color, kSize);
        const Value history = graph.previous({3, kSize.height, kSize.width}, "history");
        a = convolution(graph, graph.concat({color, history}), "a");
        b = convolution(graph, a, "b");
        c = convolution(graph, b, "c");
        graph.output = d = convolution(graph, graph.concat({c, a, history}), "d");
        graph.carry(history, c);
        graph.views = {{"a", a}, {"d", d}};
    }

    std::vector<int> places(int of_a, int of_b, int of_c, int of_d) const {
        std::vector<int> places(graph.nodes.size(), 0);
        places[a] = of_a, places[b] = of_b, places[c] = of_c, places[d] = of_d;
        places[graph.nodes[d].inputs[0]] = of_d;  // the concat
        return places;
    }

    Graph graph;
    Value a, b, c, d;
};

}  // namespace

TEST_SUITE("small") {
    TEST_CASE("what is on one device is one part, the graph itself") {
        const Chain chain;
        const Partition whole = partition(chain.graph, chain.places(1, 1, 1, 1));
        REQUIRE(whole.parts.size() == 1);
        CHECK(whole.links.empty());
        const Graph& graph = whole.parts[0].graph;
        CHECK(whole.parts[0].place == 1);
        CHECK(names(graph) == std::vector<std::string>{"a", "b", "c", "d"});
        CHECK(graph.states.size() == 1);
        CHECK(graph.nodes[graph.output].name == "d");
        CHECK(graph.views.size() == 2);
        CHECK(graph.exports.empty());
    }

    TEST_CASE("parts come after those they read, and no path leaves one and comes back") {
        const Chain chain;
        const Partition cut = partition(chain.graph, chain.places(0, 1, 1, 0));
        REQUIRE(cut.parts.size() == 3);
        CHECK(names(cut.parts[0].graph) == std::vector<std::string>{"a"});
        CHECK(names(cut.parts[1].graph) == std::vector<std::string>{"b", "c"});
        CHECK(names(cut.parts[2].graph) == std::vector<std::string>{"d"});
        CHECK(cut.parts[1].place == 1);
        for (const Link& link : cut.links)
            if (link.frames_ago == 0) CHECK(link.from < link.to);
        CHECK(cut.parts[0].graph.output < 0);
        CHECK(cut.parts[2].graph.output >= 0);
        CHECK(cut.parts[0].graph.views.contains("a"));
        CHECK(cut.parts[2].graph.views.contains("d"));
        // Only what reads the frame's colour has it.
        for (size_t part = 0; part < 3; ++part) {
            const auto& nodes = cut.parts[part].graph.nodes;
            CHECK(std::count_if(nodes.begin(), nodes.end(), [](const Node& node) {
                      return std::holds_alternative<Input>(node.op);
                  }) == (part == 0 ? 1 : 0));
        }
    }

    TEST_CASE("a state that crosses a cut is a link to the frame before, wherever it is read") {
        const Chain chain;
        const Partition cut = partition(chain.graph, chain.places(0, 1, 1, 0));
        std::vector<int> readers;
        for (const Link& link : cut.links) {
            if (link.frames_ago == 0) continue;
            CHECK(link.frames_ago == 1);
            CHECK(link.from == 1);
            readers.push_back(link.to);
            CHECK(cut.parts[1].graph.nodes[cut.parts[1].graph.exports[link.from_port]].name == "c");
        }
        CHECK(readers == std::vector<int>{0, 2});
        for (size_t part = 0; part < cut.parts.size(); ++part) {
            CHECK(cut.parts[part].graph.states.empty());
            for (const Node& node : cut.parts[part].graph.nodes) {
                const auto* import = std::get_if<Import>(&node.op);
                if (!import) continue;
                CHECK(std::any_of(cut.links.begin(), cut.links.end(), [&](const Link& link) {
                    return link.to == static_cast<int>(part) && link.to_port == import->port &&
                           link.frames_ago == import->frames_ago;
                }));
            }
        }
    }

    TEST_CASE("a state that is made and read in one part stays there") {
        Graph graph;
        const Value color = graph.input(Resource::color, kSize);
        const Value history = graph.previous({3, kSize.height, kSize.width}, "history");
        const Value sum = graph.sum(color, history, "sum");
        const Value a = convolution(graph, sum, "a");
        graph.output = convolution(graph, a, "b");
        graph.carry(history, sum);
        std::vector<int> places(graph.nodes.size(), 0);
        places[graph.output] = 1;
        const Partition cut = partition(graph, places);
        REQUIRE(cut.parts.size() == 2);
        CHECK(cut.parts[0].graph.states.size() == 1);
        CHECK(cut.links.size() == 1);
    }

    TEST_CASE("views of memory are repeated where they are read, and what is under them crosses once") {
        Graph graph;
        const Value color = graph.input(Resource::color, kSize);
        const Value a = convolution(graph, color, "a");
        const Value first = graph.slice(a, 0, 1), rest = graph.slice(a, 1, 2);
        graph.output = convolution(graph, graph.concat({first, rest, color}), "b");
        std::vector<int> places(graph.nodes.size(), 1);
        places[a] = 0;
        const Partition cut = partition(graph, places);
        REQUIRE(cut.parts.size() == 2);
        REQUIRE(cut.links.size() == 1);
        CHECK(cut.parts[0].graph.exports.size() == 1);
        const auto& nodes = cut.parts[1].graph.nodes;
        CHECK(std::count_if(nodes.begin(), nodes.end(),
                            [](const Node& node) { return std::holds_alternative<Slice>(node.op); }) == 2);
    }

    TEST_CASE("what crosses keeps memory of its own when its part is fused again") {
        Graph graph;
        const Value color = graph.input(Resource::color, kSize);
        const Value a = convolution(graph, color, "a");
        const Value p = graph.tanh(a, "p");
        const Value both = graph.concat({p, color});
        const Value b = convolution(graph, both, "b"), c = convolution(graph, p, "c");
        graph.output = convolution(graph, graph.concat({b, c}), "d");
        std::vector<int> places(graph.nodes.size(), 0);
        places[c] = 1;
        const Partition cut = partition(graph, places);
        const Graph fused = fuse(cut.parts[0].graph, {});
        CHECK(std::any_of(fused.exports.begin(), fused.exports.end(), [&](Value value) {
            return std::holds_alternative<Pointwise>(fused.nodes[value].op) && fused.shape(value) == graph.shape(p);
        }));
    }

    TEST_CASE("what whole numbers alone read crosses as bytes where it is copied") {
        const Quantization as{0.5f, 3}, otherwise{0.25f, 3};
        const auto graph_of = [](const std::vector<std::optional<Quantization>>& readers) {
            Graph graph;
            const Value a = convolution(graph, graph.input(Resource::color, kSize), "a");
            std::vector<Value> results;
            for (const auto& rounds : readers) {
                results.push_back(convolution(graph, a, "b"));
                std::get<Convolution>(graph.nodes[results.back()].op).rounds = rounds;
            }
            graph.output = graph.slice(graph.concat(results), 0, 3);
            return graph;
        };
        const auto exported = [](const Graph& graph, bool copied) {
            std::vector<int> places(graph.nodes.size(), 1);
            places[1] = 0;  // a
            const Partition cut = partition(graph, places, [&](int, int) { return copied; });
            REQUIRE(cut.parts.size() == 2);
            REQUIRE(cut.links.size() == 1);
            const Graph& maker = cut.parts[0].graph;
            const auto* numbers = std::get_if<Numbers>(&maker.nodes[maker.exports[0]].op);
            for (const Node& node : cut.parts[1].graph.nodes)
                if (const auto* import = std::get_if<Import>(&node.op))
                    CHECK((import->stored == Stored::bytes) == (numbers != nullptr));
            return numbers ? std::optional(numbers->quantization) : std::nullopt;
        };
        CHECK(exported(graph_of({as}), true) == as);
        CHECK(exported(graph_of({as, as}), true) == as);
        CHECK(exported(graph_of({as}), false) == std::nullopt);
        CHECK(exported(graph_of({as, otherwise}), true) == std::nullopt);
        CHECK(exported(graph_of({as, std::nullopt}), true) == std::nullopt);
        CHECK(exported(graph_of({std::nullopt}), true) == std::nullopt);
    }

    TEST_CASE("of a value that several parts read one form is copied, and none for what the frame before made") {
        const Quantization as{0.5f, 3};
        const auto rounding = [&](Graph& graph, Value image, const char* name) {
            const Value made = convolution(graph, image, name);
            std::get<Convolution>(graph.nodes[made].op).rounds = as;
            return made;
        };
        // What device 0 makes is read by a part of device 1 and by one of device 2.
        const auto exports = [&](bool both_round, const std::function<bool(int, int)>& copied) {
            Graph graph;
            const Value a = convolution(graph, graph.input(Resource::color, kSize), "a");
            const Value b = rounding(graph, a, "b");
            const Value c = both_round ? rounding(graph, a, "c") : convolution(graph, a, "c");
            graph.output = graph.concat({b, c});
            std::vector<int> places(graph.nodes.size(), 0);
            places[b] = 1, places[c] = 2;
            const Partition cut = partition(graph, places, copied);
            std::vector<std::string> names;
            for (const Link& link : cut.links)
                if (link.from == 0)
                    names.push_back(cut.parts[0].graph.nodes[cut.parts[0].graph.exports[link.from_port]].name);
            return names;
        };
        using Names = std::vector<std::string>;
        const auto all = [](int, int) { return true; };
        CHECK(exports(true, all) == Names{"a in bytes", "a in bytes"});
        CHECK(exports(false, all) == Names{"a", "a"});
        CHECK(exports(true, [](int, int to) { return to == 1; }) == Names{"a in bytes", "a"});
        CHECK(exports(false, [](int, int to) { return to == 1; }) == Names{"a in bytes", "a"});

        Graph graph;
        const Value color = graph.input(Resource::color, kSize);
        const Value history = graph.previous({3, kSize.height, kSize.width}, "history");
        const Value a = convolution(graph, color, "a");
        graph.output = rounding(graph, history, "b");
        graph.carry(history, a);
        std::vector<int> places(graph.nodes.size(), 0);
        places[graph.output] = 1;
        const Partition cut = partition(graph, places, all);
        REQUIRE(cut.links.size() == 1);
        CHECK(cut.links[0].frames_ago == 1);
        CHECK(cut.parts[0].graph.nodes[cut.parts[0].graph.exports[0]].name == "a");
    }

    TEST_CASE("bytes cross as they are, and what convolutions read in another way as it is stored") {
        const Quantization as{0.5f, 3};
        for (const bool bytes : {false, true}) {
            Graph graph;
            const Value a = convolution(graph, graph.input(Resource::color, kSize), "a");
            graph.output = convolution(graph, a, "b");
            auto& reader = std::get<Convolution>(graph.nodes[graph.output].op);
            reader.rounds = as;
            if (bytes)
                std::get<Convolution>(graph.nodes[a].op).result = as;
            else
                reader.readings = {Reading::pooled};
            std::vector<int> places(graph.nodes.size(), 0);
            places[graph.output] = 1;
            const Partition cut = partition(graph, places, [](int, int) { return true; });
            const Graph& maker = cut.parts[0].graph;
            CHECK(std::holds_alternative<Convolution>(maker.nodes[maker.exports[0]].op));
        }
    }

    TEST_CASE("what gathers the frame's inputs alone is made in every part that reads it") {
        Graph graph;
        const Value frame = graph.concat({graph.input(Resource::color, kSize), graph.input(Resource::depth, kSize)});
        const Value a = convolution(graph, frame, "a");
        graph.output = convolution(graph, graph.concat({a, frame}), "b");
        std::vector<int> places(graph.nodes.size(), 1);
        places[a] = 0;
        const Partition cut = partition(graph, places);
        CHECK(cut.parts.size() == 2);
        CHECK(cut.links.size() == 1);
    }
}
