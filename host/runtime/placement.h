#pragma once

#include <functional>
#include <span>
#include <string_view>
#include <vector>

#include "clarus/device.h"
#include "graph/graph.h"
#include "graph/partition.h"

namespace clarus::runtime {

/// For each node of a fused graph the number of its device, by the rules that StreamOptions::placement documents.
/// Errors: invalid_argument for a rule that names no stage or no device.
std::vector<int> place_by_rules(const graph::Graph& graph, std::string_view rules,
                                std::span<const DeviceProfile> devices);

/// What a placement is chosen by.
struct PlacementCosts {
    /// [device][node]. Of the frame's inputs: what ingesting them takes, in each part that reads them. What presenting
    /// takes counts for the node that makes the output.
    std::vector<std::vector<double>> seconds;
    /// How long so many bytes take from one device to another.
    std::function<double(int from, int to, double bytes)> transfer;
    std::function<bool(int from, int to)> copied;  // as graph::partition has it
    int bytes_of_a_float = 4;                      // as images are stored
};

/// Seconds of each part's work of a frame, without waiting. `graph`, `places`: what is cut.
std::vector<double> seconds_of_parts(const graph::Graph& graph, const std::vector<int>& places,
                                     const graph::Partition& partition,
                                     const std::vector<std::vector<double>>& seconds);

/// Seconds from frame to frame, once many are on their way, and of one frame from its start to its end.
struct PlacementTime {
    double period, latency;
};
PlacementTime placement_time(const graph::Graph& graph, const std::vector<int>& places, const PlacementCosts& costs);

/// The placement with the fewest seconds from frame to frame; of many stages, what moving neighbouring ones to another
/// device makes of all on one, for as long as it gets better. All on one device unless others save 5 % at least.
std::vector<int> place_for_speed(const graph::Graph& graph, const PlacementCosts& costs);

}  // namespace clarus::runtime
