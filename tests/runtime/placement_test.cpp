#include "runtime/placement.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <random>

#include "clarus/error.h"
#include "graph/passes.h"
#include "zero_parameters.h"

using namespace clarus;
using namespace clarus::graph;
using namespace clarus::runtime;

namespace {

constexpr Size kSize{6, 4};

/// Convolutions one after the other; where it is recurrent, the first reads what the last made a frame ago.
Graph chain(int length, bool recurrent) {
    Graph graph;
    Value x = graph.input(Resource::color, kSize);
    const Value history = recurrent ? graph.previous({3, kSize.height, kSize.width}, "history") : -1;
    if (recurrent) x = graph.concat({x, history});
    for (int i = 0; i < length; ++i)
        x = graph.convolution(x, zero_parameters(3, graph.shape(x).channels), Activation::none,
                              "convolution " + std::to_string(i));
    if (recurrent) graph.carry(history, x);
    graph.output = x;
    return fuse(graph, {});
}

std::vector<Value> stages(const Graph& graph) {
    std::vector<Value> result;
    for (Value value = 0; value < static_cast<Value>(graph.nodes.size()); ++value)
        if (std::holds_alternative<Convolution>(graph.nodes[value].op)) result.push_back(value);
    return result;
}

PlacementCosts costs(const Graph& graph, const std::vector<std::vector<double>>& of_stages, double crossing) {
    PlacementCosts result;
    for (const std::vector<double>& device : of_stages) {
        std::vector<double>& seconds = result.seconds.emplace_back(graph.nodes.size(), 0);
        const std::vector<Value> made = stages(graph);
        for (size_t stage = 0; stage < made.size(); ++stage) seconds[made[stage]] = device[stage];
    }
    result.transfer = [crossing](int from, int to, double) { return from == to ? 0.0 : crossing; };
    return result;
}

std::vector<DeviceProfile> two_devices() {
    std::vector<DeviceProfile> devices(2);
    devices[0].device_class = DeviceClass::gpu;
    devices[1].device_class = DeviceClass::dsp;
    return devices;
}

}  // namespace

TEST_SUITE("small") {
    TEST_CASE("a device that is much faster gets everything, and one that is much slower nothing") {
        const Graph graph = chain(4, false);
        for (const int fast : {0, 1}) {
            std::vector<std::vector<double>> seconds(2, std::vector<double>(4, 1.0));
            seconds[fast].assign(4, 0.01);
            const std::vector<int> places = place_for_speed(graph, costs(graph, seconds, 0.001));
            for (const Value stage : stages(graph)) CHECK(places[stage] == fast);
        }
    }

    TEST_CASE("equal devices share a chain that is not recurrent in halves, and frames come twice as fast") {
        const Graph graph = chain(6, false);
        const PlacementCosts equal = costs(graph, {std::vector<double>(6, 1), std::vector<double>(6, 1)}, 0.01);
        const std::vector<int> places = place_for_speed(graph, equal);
        const std::vector<Value> made = stages(graph);
        CHECK(std::count_if(made.begin(), made.end(), [&](Value stage) { return places[stage] == 1; }) == 3);
        CHECK(placement_time(graph, places, equal).period == doctest::Approx(3));
        CHECK(placement_time(graph, places, equal).latency == doctest::Approx(6.01));
    }

    TEST_CASE("of a chain that needs its own last result nothing can overlap, and nothing crosses") {
        const Graph graph = chain(4, true);
        const PlacementCosts equal = costs(graph, {std::vector<double>(4, 1), std::vector<double>(4, 1)}, 0.01);
        const std::vector<int> places = place_for_speed(graph, equal);
        for (const Value stage : stages(graph)) CHECK(places[stage] == places[stages(graph)[0]]);
    }

    TEST_CASE("nothing crosses where that takes longer than it saves") {
        const Graph graph = chain(2, true);
        // The second device would save 0.5 s of the second convolution.
        const std::vector<std::vector<double>> seconds{{1, 1}, {3, 0.5}};
        CHECK(place_for_speed(graph, costs(graph, seconds, 0.3))[stages(graph)[1]] == 0);
        CHECK(place_for_speed(graph, costs(graph, seconds, 0.1))[stages(graph)[1]] == 1);
    }

    TEST_CASE("no placement of a short chain is better than the one chosen") {
        std::mt19937 random(5);
        for (int seed = 0; seed < 20; ++seed) {
            const Graph graph = chain(5, seed % 2 == 1);
            std::vector<std::vector<double>> seconds(2, std::vector<double>(5));
            for (auto& device : seconds)
                for (double& each : device) each = 0.1 + static_cast<double>(random() % 100) / 100;
            const PlacementCosts given = costs(graph, seconds, 0.02 * (seed % 5));
            const double chosen = placement_time(graph, place_for_speed(graph, given), given).period;
            double least = chosen;
            for (int bits = 0; bits < 32; ++bits) {
                std::vector<int> places(graph.nodes.size(), 0);
                for (int stage = 0; stage < 5; ++stage) places[stages(graph)[stage]] = bits >> stage & 1;
                least = std::min(least, placement_time(graph, places, given).period);
            }
            CAPTURE(seed);
            CHECK(chosen <= least / 0.95);  // less is taken for noise
        }
    }

    TEST_CASE("ingesting counts in every part that reads the frame, presenting where the output is made") {
        Graph graph;
        const Value color = graph.input(Resource::color, kSize);
        const Value made = graph.convolution(color, zero_parameters(3, 3), Activation::none, "convolution 0");
        const Value other = graph.convolution(color, zero_parameters(3, 3), Activation::none, "convolution 1");
        graph.output = graph.sum(made, other, "sum");
        graph = fuse(graph, {});
        PlacementCosts given = costs(graph, {{1, 1}, {1, 1}}, 0);
        for (Value value = 0; value < static_cast<Value>(graph.nodes.size()); ++value)
            if (std::holds_alternative<Input>(graph.nodes[value].op))
                given.seconds[0][value] = 0.5, given.seconds[1][value] = 0.75;
        for (auto& seconds : given.seconds) seconds[graph.output] = 0.25;
        std::vector<int> places(graph.nodes.size(), 0);
        places[stages(graph)[1]] = places[graph.output] = 1;
        const Partition cut = partition(graph, places);
        REQUIRE(cut.parts.size() == 3);  // the sum waits for the other device
        CHECK(seconds_of_parts(graph, places, cut, given.seconds) == std::vector<double>{1.5, 1.75, 0.25});
        CHECK(placement_time(graph, places, given).latency == doctest::Approx(2));
        const std::vector<int> one(graph.nodes.size(), 1);
        CHECK(seconds_of_parts(graph, one, partition(graph, one), given.seconds) == std::vector<double>{3});
    }

    TEST_CASE("moving is counted by bytes: what whole numbers alone read takes a quarter where it is copied") {
        Graph graph = chain(2, false);
        std::get<Convolution>(graph.nodes[graph.output].op).rounds = Quantization{0.5f, 3};
        PlacementCosts given = costs(graph, {{1, 1}, {1, 1}}, 0);
        given.transfer = [](int from, int to, double bytes) { return from == to ? 0 : bytes; };
        std::vector<int> places(graph.nodes.size(), 0);
        places[graph.output] = 1;
        constexpr int kElements = kSize.width * kSize.height * 4;  // channels come in fours
        for (const bool copied : {false, true}) {
            given.copied = [copied](int, int) { return copied; };
            CHECK(placement_time(graph, places, given).latency == doctest::Approx(2 + kElements * (copied ? 1 : 4)));
        }
    }

    TEST_CASE("few placements of a long chain are better than the one chosen") {
        std::mt19937 random(9);
        constexpr int kStages = 16, kTries = 500;
        for (const bool recurrent : {false, true}) {
            const Graph graph = chain(kStages, recurrent);
            std::vector<std::vector<double>> seconds(2, std::vector<double>(kStages));
            for (auto& device : seconds)
                for (double& each : device) each = 0.1 + static_cast<double>(random() % 100) / 100;
            const PlacementCosts given = costs(graph, seconds, 0.05);
            const double chosen = placement_time(graph, place_for_speed(graph, given), given).period;
            int better = 0;
            for (int i = 0; i < kTries; ++i) {
                std::vector<int> places(graph.nodes.size(), 0);
                for (const Value stage : stages(graph)) places[stage] = static_cast<int>(random() % 2);
                better += placement_time(graph, places, given).period < chosen;
            }
            CHECK(better <= kTries / 100);
        }
    }

    TEST_CASE("rules place stages by their names; the last that fits counts") {
        const Graph graph = chain(3, false);
        const std::vector<Value> made = stages(graph);
        const auto placed = [&](const char* rules) {
            const std::vector<int> places = place_by_rules(graph, rules, two_devices());
            return std::vector<int>{places[made[0]], places[made[1]], places[made[2]]};
        };
        CHECK(placed("") == std::vector<int>{0, 0, 0});
        CHECK(placed("convolution*=dsp") == std::vector<int>{1, 1, 1});
        CHECK(placed("convolution*=dsp, * 1=gpu") == std::vector<int>{1, 0, 1});
        CHECK(placed(" convolution 2 = 1 ,,") == std::vector<int>{0, 0, 1});
    }

    TEST_CASE("a rule that names no stage, no device, or nothing is refused, with what there is") {
        const Graph graph = chain(2, false);
        const auto message = [&](const char* rules) {
            try {
                place_by_rules(graph, rules, two_devices());
            } catch (const Error& error) {
                CHECK(error.kind() == ErrorKind::invalid_argument);
                return std::string(error.what());
            }
            return std::string();
        };
        CHECK(message("warp=dsp").find("convolution 1") != std::string::npos);
        CHECK(message("convolution*=cpu").find("1 (dsp)") != std::string::npos);
        CHECK(message("convolution*=2").find("'2'") != std::string::npos);
        CHECK(message("convolution*=-1").find("'-1'") != std::string::npos);
        CHECK(message("convolution 1").find("PATTERN=DEVICE") != std::string::npos);
    }
}
