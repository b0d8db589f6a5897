#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "cl/context.h"
#include "runtime/implementation.h"

namespace clarus::runtime {

/// An implementation with its open settings fixed.
struct Selection {
    const Implementation* implementation = nullptr;
    Choices choices;

    Lowered lower(const Problem& problem) const { return implementation->lower(problem, choices); }
    std::string describe() const;  // "winograd TILES=12"
};

/// What the device's class suggests: the most preferred implementation with its built-in choices.
Selection built_in_selection(const Problem& problem, const DeviceProfile& profile);

/// The simplest way to run the operator.
Selection obvious_selection(const Problem& problem, const DeviceProfile& profile);

/// What was found out about a problem.
struct TuningResult {
    std::string implementation;
    Choices choices;
    double seconds = 0;
    double built_in_seconds = 0;  // of the built-in choice; 0 where it could not run
};
using TuningResults = std::map<std::string, TuningResult>;  // by problem

/// Everything that the fastest kernel depends on but the device: the operator, layouts, the magnitudes of sizes.
std::string problem_key(const Problem& problem, const DeviceProfile& profile);

/// The candidate that a result names, if there is such a one for the device.
std::optional<Selection> candidate_of(const TuningResult& result, const Problem& problem, const DeviceProfile& profile);

/// Chooses how operators run on one device and remembers what was measured, in a readable file a device under
/// cache_directory()/tuning. Processes that measure at the same time add to it.
class Tuner {
  public:
    Tuner(ocl::Context& context, Tuning mode);

    /// Where anything would have to be measured (mode `measure` alone), does so: compiles and runs every candidate.
    Selection select(const Problem& problem);

    /// Without measuring: what is stored, else what the table of the device's class says (tuned_table.h), else the
    /// built-in choice.
    Selection select_without_measuring(const Problem& problem) const;

  private:
    Selection measure(const Problem& problem, const std::vector<Selection>& candidates);
    /// Where nothing is stored: by the mode.
    Selection unmeasured(const Problem& problem) const;
    std::optional<Selection> stored_selection(const Problem& problem, const std::vector<Selection>& candidates) const;
    TuningResults stored() const;
    void store();

    ocl::Context& context_;
    Tuning mode_;
    std::string path_;
    TuningResults results_;
    bool warned_unwritable_ = false;
};

}  // namespace clarus::runtime
