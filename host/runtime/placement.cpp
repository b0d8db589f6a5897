#include "runtime/placement.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <utility>

#include "base/error.h"
#include "base/parse.h"
#include "base/platform.h"
#include "base/rounding.h"
#include "cl/platforms.h"
#include "runtime/implementation.h"

namespace clarus::runtime {
namespace {

using graph::Graph;
using graph::Value;

Value size_of(const Graph& graph) { return static_cast<Value>(graph.nodes.size()); }

bool launches(const Graph& graph, Value value) { return !implementations(graph.nodes[value]).empty(); }

/// What is gathered in one memory, without a kernel, is where the last of it is made.
void place_gathered(const Graph& graph, std::vector<int>& places) {
    const auto place_of = [&](Value value) {
        while (graph::aliases_memory(graph.nodes[value].op)) {
            if (graph.nodes[value].inputs.empty()) return -1;
            value = graph.nodes[value].inputs[0];
        }
        return launches(graph, value) || graph::is_view(graph.nodes[value].op) ? places[value] : -1;
    };
    for (Value value = 0; value < size_of(graph); ++value) {
        if (graph::traits(graph.nodes[value].op).memory != graph::Memory::gathers) continue;
        std::optional<int> place;
        for (const Value input : graph.nodes[value].inputs)
            if (const int made = place_of(input); made >= 0) place = made;
        places[value] = place.value_or(0);
    }
}

int device_named(std::string_view name, std::span<const DeviceProfile> devices) {
    for (size_t device = 0; device < devices.size(); ++device)
        if (name == ocl::class_name(devices[device].device_class)) return static_cast<int>(device);
    if (const auto number = parse_whole<int>(name);
        number && *number >= 0 && *number < static_cast<int>(devices.size()))
        return *number;
    std::string known;
    for (size_t device = 0; device < devices.size(); ++device)
        known +=
            fmt::format("{}{} ({})", known.empty() ? "" : ", ", device, ocl::class_name(devices[device].device_class));
    fail(ErrorKind::invalid_argument, "options.placement: there is no device '{}'; there are {}", name, known);
}

std::string stage_names(const Graph& graph) {
    std::string names;
    for (Value value = 0; value < size_of(graph); ++value)
        if (launches(graph, value)) names += "\n  " + graph.nodes[value].name;
    return names;
}

/// When each of several parts could start, device after device, for some frames.
class Simulation {
  public:
    Simulation(const Graph& graph, const std::vector<int>& places, const PlacementCosts& costs)
        : partition_(graph::partition(graph, places, costs.copied)),
          costs_(costs),
          seconds_(seconds_of_parts(graph, places, partition_, costs.seconds)),
          free_(costs.seconds.size(), 0) {}

    PlacementTime run() {
        constexpr int kFrames = 8;
        std::array<double, kFrames> ends{};
        std::array<double, kFrames> starts{};
        std::vector<double> before(partition_.parts.size(), 0);
        for (int frame = 0; frame < kFrames; ++frame) {
            std::vector<double> now(partition_.parts.size(), 0);
            for (size_t part = 0; part < partition_.parts.size(); ++part) {
                double ready = frame > 0 ? before[part] : 0;
                for (const graph::Link& link : partition_.links)
                    if (link.to == static_cast<int>(part))
                        ready = std::max(ready, (link.frames_ago ? before : now)[link.from] + moving(link));
                double& free = free_[partition_.parts[part].place];
                const double start = std::max(ready, free);
                if (part == 0) starts[frame] = start;
                free = now[part] = start + seconds_[part];
                ends[frame] = std::max(ends[frame], now[part]);
            }
            before = now;
        }
        return {(ends[kFrames - 1] - ends[kFrames / 2 - 1]) / (kFrames / 2), ends[0] - starts[0]};
    }

  private:
    /// As layouts have it: a pixel takes a multiple of four elements.
    double bytes_of(const Graph& graph, Value value) const {
        constexpr int kElements = 4;
        const bool in_bytes = graph::traits(graph.nodes[value].op).stored == graph::Stored::bytes;
        const graph::Shape& shape = graph.shape(value);
        return double(shape.width) * shape.height * round_up(shape.channels, kElements) *
               (in_bytes ? 1 : costs_.bytes_of_a_float);
    }
    double moving(const graph::Link& link) const {
        const graph::Part& from = partition_.parts[link.from];
        const Value value = from.graph.exports[link.from_port];
        return costs_.transfer(from.place, partition_.parts[link.to].place, bytes_of(from.graph, value));
    }

    graph::Partition partition_;
    const PlacementCosts& costs_;
    std::vector<double> seconds_;  // of each part
    std::vector<double> free_;     // when each device is
};

/// A placement, and its seconds from frame to frame.
struct Placed {
    double period = std::numeric_limits<double>::infinity();
    std::vector<int> places;
    bool operator<(const Placed& other) const { return period < other.period; }
};

Placed timed(const Graph& graph, std::vector<int> places, const PlacementCosts& costs) {
    place_gathered(graph, places);
    const double period = Simulation(graph, places, costs).run().period;
    return {period, std::move(places)};
}

Placed best_of_all(const Graph& graph, const std::vector<Value>& stages, const PlacementCosts& costs) {
    const int devices = static_cast<int>(costs.seconds.size());
    Placed best;
    std::vector<int> places(graph.nodes.size(), 0);
    for (size_t counted = 0; counted < stages.size();) {
        best = std::min(best, timed(graph, places, costs));
        for (counted = 0; counted < stages.size(); ++counted) {  // the next of all numbers of so many digits
            int& digit = places[stages[counted]];
            if (++digit < devices) break;
            digit = 0;
        }
    }
    return best;
}

/// With neighbouring stages moved to another device, the best of such moves at a time, for as long as it gets better.
Placed bettered(Placed start, const Graph& graph, const std::vector<Value>& stages, const PlacementCosts& costs) {
    constexpr double kStep = 0.995;
    for (Placed next = start;; start = next) {
        for (int device = 0; device < static_cast<int>(costs.seconds.size()); ++device)
            for (size_t first = 0; first < stages.size(); ++first) {
                std::vector<int> places = start.places;
                for (size_t last = first; last < stages.size(); ++last) {
                    places[stages[last]] = device;
                    next = std::min(next, timed(graph, places, costs));
                }
            }
        if (next.period > kStep * start.period) return next;
    }
}

}  // namespace

std::vector<int> place_by_rules(const Graph& graph, std::string_view rules, std::span<const DeviceProfile> devices) {
    std::vector<int> places(graph.nodes.size(), 0);
    for (const std::string_view part : between_commas(rules)) {
        const std::string_view rule = trimmed(part);
        if (rule.empty()) continue;
        const size_t equals = rule.rfind('=');
        if (equals == rule.npos)
            fail(ErrorKind::invalid_argument, "options.placement: '{}' is no rule; PATTERN=DEVICE is", rule);
        const std::string pattern(trimmed(rule.substr(0, equals)));
        const int device = device_named(trimmed(rule.substr(equals + 1)), devices);
        bool fits = false;
        for (Value value = 0; value < size_of(graph); ++value) {
            if (!launches(graph, value) || !fits_pattern(pattern, graph.nodes[value].name)) continue;
            places[value] = device;
            fits = true;
        }
        if (!fits)
            fail(ErrorKind::invalid_argument, "options.placement: no stage is called '{}'; there are{}", pattern,
                 stage_names(graph));
    }
    place_gathered(graph, places);
    return places;
}

std::vector<double> seconds_of_parts(const Graph& graph, const std::vector<int>& places,
                                     const graph::Partition& partition,
                                     const std::vector<std::vector<double>>& seconds) {
    std::vector<double> result;
    for (const graph::Part& part : partition.parts) {
        double& its = result.emplace_back(0);
        for (const Value value : part.read) its += seconds[part.place][value];
    }
    const std::vector<int> parts = graph::part_of_nodes(graph, places);
    for (Value value = 0; value < size_of(graph); ++value)
        if (parts[value] >= 0) result[parts[value]] += seconds[places[value]][value];
    return result;
}

PlacementTime placement_time(const Graph& graph, const std::vector<int>& places, const PlacementCosts& costs) {
    return Simulation(graph, places, costs).run();
}

std::vector<int> place_for_speed(const Graph& graph, const PlacementCosts& costs) {
    constexpr double kGain = 0.95;  // of all on one device: less is noise of what was measured
    constexpr double kFew = 4096;   // placements that are all tried
    std::vector<Value> stages;
    for (Value value = 0; value < size_of(graph); ++value)
        if (launches(graph, value)) stages.push_back(value);
    const int devices = static_cast<int>(costs.seconds.size());

    Placed best;
    for (int device = 0; device < devices; ++device)
        best = std::min(best, timed(graph, std::vector<int>(graph.nodes.size(), device), costs));
    const Placed alone = best;
    if (std::pow(devices, stages.size()) <= kFew) {
        best = std::min(best, best_of_all(graph, stages, costs));
    } else {
        for (int device = 0; device < devices; ++device)
            best = std::min(best, bettered(timed(graph, std::vector<int>(graph.nodes.size(), device), costs), graph,
                                           stages, costs));
    }
    return best.period < kGain * alone.period ? best.places : alone.places;
}

}  // namespace clarus::runtime
