#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "clarus/types.h"
#include "measure/statistics.h"

namespace clarus::measure {

/// What two result files say of one thing that was measured in both.
struct Change {
    Figure a, b;
    Ratio b_over_a = ratio(a, b);

    /// Whether both had turns enough for an interval: else nothing can be told.
    bool is_bounded() const { return median_ranks(a.turns) && median_ranks(b.turns); }
};

struct DeviceChange {
    std::string a, b;  // names
    Change compute_peak, copy_bandwidth;
};

struct StageChange {
    std::string name;
    Change seconds;
};

struct ItemChange {
    size_t device = 0;  // in Comparison::devices
    std::string model, precision;
    Size output_size;
    std::optional<Change> latency, frames_per_second;  // none where a side has no score
    std::string no_score;                              // then why
    std::vector<StageChange> stages;                   // that both have
};

/// Something other than a time that differs: a driver, a commit, a kernel.
struct Fact {
    std::string what, a, b;
};

struct Comparison {
    std::vector<Fact> facts;
    std::vector<DeviceChange> devices;
    std::vector<ItemChange> items;
    std::vector<std::string> only_a, only_b;  // items that the other file lacks, with their device where there are more
};

/// Two files of `clarus bench`. Devices of the same name and platform belong together; others, one to one in their
/// order. Items belong together that are of one model, output size and precision. Errors: file.
Comparison compare(const std::filesystem::path& a, const std::filesystem::path& b);

}  // namespace clarus::measure
