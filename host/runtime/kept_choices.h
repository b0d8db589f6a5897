#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>

#include "runtime/plan.h"

namespace clarus::runtime {

/// What was chosen for a plan, for plans of its network at other sizes: what is compiled, and the order in which
/// weights are packed, then serve them, too.
class KeptChoices {
  public:
    KeptChoices(const Plan& plan, const DeviceProfile& profile);

    /// Keeps what was chosen for convolutions that no plan had before.
    void add(const Plan& plan);

    const std::vector<BandChoice>& bands() const { return bands_; }

    /// The kernel of the same stage, or none where the plan has no such stage, or a kernel that does not suit this
    /// problem.
    std::optional<Selection> find(const Problem& problem) const;

  private:
    using Key = std::pair<size_t, std::string>;  // the operator; its name, or its parameters' number
    static Key key_of(const Problem& problem);

    const DeviceProfile profile_;
    const std::vector<BandChoice> bands_;
    std::map<Key, Selection> selections_;
};

}  // namespace clarus::runtime
