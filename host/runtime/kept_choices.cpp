#include "runtime/kept_choices.h"

#include <algorithm>
#include <vector>

namespace clarus::runtime {

KeptChoices::KeptChoices(const Plan& plan, const DeviceProfile& profile)
    : profile_(profile), bands_(plan.band_choices) {
    for (const PlannedStage& stage : plan.stages) selections_.emplace(key_of(stage.problem), stage.selection);
}

void KeptChoices::add(const Plan& plan) {
    for (const PlannedStage& stage : plan.stages)
        if (std::holds_alternative<graph::Convolution>(stage.problem.node.op))
            selections_.emplace(key_of(stage.problem), stage.selection);
}

KeptChoices::Key KeptChoices::key_of(const Problem& problem) {
    const graph::Operator& op = problem.node.op;
    const auto* convolution = std::get_if<graph::Convolution>(&op);
    return {op.index(), convolution ? std::to_string(convolution->parameters) : problem.node.name};
}

std::optional<Selection> KeptChoices::find(const Problem& problem) const {
    const auto found = selections_.find(key_of(problem));
    if (found == selections_.end()) return std::nullopt;
    const Selection& selection = found->second;
    if (std::holds_alternative<graph::Convolution>(problem.node.op)) return selection;  // as its weights are packed
    // Several stages may have one name.
    const Implementation& implementation = *selection.implementation;
    if (implementation.preference(problem, profile_) == 0) return std::nullopt;
    const std::vector<Choices> choices = implementation.choices(problem, profile_);
    if (std::find(choices.begin(), choices.end(), selection.choices) == choices.end()) return std::nullopt;
    return selection;
}

}  // namespace clarus::runtime
