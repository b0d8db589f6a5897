#pragma once

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "clarus/device.h"
#include "clarus/stream.h"
#include "graph/graph.h"

namespace clarus {

/// What placing by measuring has chosen for a network on these devices, kept in cache_directory()/placements: another
/// process begins with it at once. What the file says is checked; where there is none, or one of something else, the
/// placement is measured again.
class KeptPlacement {
  public:
    /// `graph`: fused, of the size that is placed. `copied`: as graph::partition has it.
    KeptPlacement(const graph::Graph& graph, std::span<const DeviceProfile> devices,
                  const std::function<bool(int from, int to)>& copied, const StreamOptions& options);

    struct Choice {
        std::vector<int> places;                   // by node, as partition's
        std::vector<std::vector<double>> seconds;  // [device][node], as PlacementCosts'
    };
    /// Empty where none is kept.
    Choice find() const;
    /// Where it cannot be kept, it is measured again the next time.
    void keep(const Choice& choice) const;

  private:
    std::string file_;  // empty where there is no cache
    size_t nodes_, devices_;
};

}  // namespace clarus
