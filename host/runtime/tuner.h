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

/// Chooses how operators run on one device and remembers what was measured, in a readable file a device under
/// cache_directory()/tuning. Processes that measure at the same time add to it.
class Tuner {
  public:
    Tuner(ocl::Context& context, Tuning mode);

    /// Where anything would have to be measured (mode `measure` alone), does so: compiles and runs every candidate.
    Selection select(const Problem& problem);

    /// Without measuring: what is stored, else the built-in choice.
    Selection select_without_measuring(const Problem& problem) const;

  private:
    struct Result {
        std::string implementation;
        Choices choices;
        double seconds = 0;
    };
    using Results = std::map<std::string, Result>;  // by problem

    Selection measure(const Problem& problem, const std::vector<Selection>& candidates);
    /// Where nothing is stored: by the mode.
    Selection unmeasured(const Problem& problem) const;
    std::optional<Selection> stored_selection(const Problem& problem, const std::vector<Selection>& candidates) const;
    Results stored() const;
    void store();

    ocl::Context& context_;
    Tuning mode_;
    std::string path_;
    Results results_;
    bool unwritable_ = false;  // and said so
};

}  // namespace clarus::runtime
