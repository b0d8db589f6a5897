#pragma once

#include <vector>

#include "clarus/types.h"

namespace clarus::runtime {

/// Which set of jitter-conditioned kernels serves a frame (docs/pipelines.md, "Jitter-conditioned kernels"): a table's
/// entry, or one of a bounded number of sets computed when their jitter first appears, the least recently used making
/// room.
class JitterSets {
  public:
    /// `table`: the jitter of sets 0…K−1. `computed`: how many sets after these may be computed; 0 where nothing
    /// computes them, and then the table is not empty.
    JitterSets(std::vector<Vec2> table, int computed);

    struct Selection {
        int set;
        bool compute;  // the set's kernels are not there yet
    };
    Selection select(Vec2 jitter);

    /// The set that was to be computed could not be.
    void forget(int set);

    /// The most that a jitter was away from the table's nearest entry where that entry had to serve, in render pixels.
    double largest_distance() const { return largest_distance_; }

  private:
    struct Computed {
        Vec2 jitter;
        unsigned long long last_used = 0;  // 0: empty
    };

    std::vector<Vec2> table_;
    std::vector<Computed> computed_;
    unsigned long long clock_ = 0;
    double largest_distance_ = 0;
};

}  // namespace clarus::runtime
