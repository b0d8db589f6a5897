#include "runtime/profiler.h"

#include <algorithm>
#include <map>
#include <utility>

#include "cl/error.h"

namespace clarus::runtime {

int Profiler::add_stage(std::string name, std::string kernel, double operations, double bytes) {
    for (int stage = 0; stage < static_cast<int>(stages_.size()); ++stage) {
        const StageProfile& known = stages_[stage].profile;
        if (known.name != name || known.kernel != kernel) continue;
        if (std::find(declared_.begin(), declared_.end(), stage) != declared_.end()) continue;
        declared_.push_back(stage);
        return stage;
    }
    Stage stage;
    stage.profile.name = std::move(name);
    stage.profile.kernel = std::move(kernel);
    stage.profile.operations = operations;
    stage.profile.bytes = bytes;
    stages_.push_back(std::move(stage));
    declared_.push_back(static_cast<int>(stages_.size()) - 1);
    return declared_.back();
}

cl::Event* Profiler::event(int stage) {
    if (!enabled_) return nullptr;
    return &stages_[stage].events.emplace_back(frame_, cl::Event()).second;
}

std::vector<StageProfile> Profiler::take() {
    std::vector<StageProfile> profiles;
    for (Stage& stage : stages_) {
        if (stage.events.empty()) continue;
        StageProfile profile = stage.profile;
        std::map<int, double> seconds_of_frames;
        for (const auto& [frame, event] : stage.events) {
            ocl::checked("read a stage's times", [&] {
                event.wait();
                const double start = 1e-9 * static_cast<double>(event.getProfilingInfo<CL_PROFILING_COMMAND_START>());
                const double end = 1e-9 * static_cast<double>(event.getProfilingInfo<CL_PROFILING_COMMAND_END>());
                profile.spans.push_back({frame, start, end});
                seconds_of_frames[frame] += end - start;
            });
        }
        std::vector<double> seconds;
        for (const auto& [frame, sum] : seconds_of_frames) seconds.push_back(sum);
        std::nth_element(seconds.begin(), seconds.begin() + seconds.size() / 2, seconds.end());
        profile.seconds = seconds[seconds.size() / 2];
        profiles.push_back(std::move(profile));
        stage.events.clear();
    }
    frame_ = -1;
    return profiles;
}

}  // namespace clarus::runtime
