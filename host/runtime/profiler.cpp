#include "runtime/profiler.h"

#include <algorithm>
#include <limits>
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

void Profiler::begin_frame() {
    ++frame_;
    for (Stage& stage : stages_)
        while (!stage.launches.empty() && stage.launches.front().frame <= frame_ - kFramesKept)
            stage.launches.pop_front();
}

cl::Event* Profiler::event(int stage) {
    if (!enabled_) return nullptr;
    return &stages_[stage].launches.emplace_back(frame_, std::chrono::steady_clock::now(), cl::Event()).event;
}

/// A command is queued just after it was asked for, and of many one with hardly anything in between.
double Profiler::clock_offset() const {
    double offset = -std::numeric_limits<double>::infinity();
    for (const Stage& stage : stages_)
        for (const Launch& launch : stage.launches) {
            const std::chrono::duration<double, std::nano> host = launch.asked_for.time_since_epoch();
            const auto queued = static_cast<double>(launch.event.getProfilingInfo<CL_PROFILING_COMMAND_QUEUED>());
            offset = std::max(offset, host.count() - queued);
        }
    return offset;
}

std::vector<StageProfile> Profiler::take() {
    std::vector<StageProfile> profiles;
    ocl::checked("read when stages ran", [&] {
        for (Stage& stage : stages_) {
            std::erase_if(stage.launches, [](const Launch& launch) { return !launch.event(); });  // that failed
            for (const Launch& launch : stage.launches) launch.event.wait();
        }
        const double offset = clock_offset();
        for (Stage& stage : stages_) {
            if (stage.launches.empty()) continue;
            StageProfile profile = stage.profile;
            std::map<int, double> seconds_of_frames;
            for (const auto& [frame, asked_for, event] : stage.launches) {
                const auto start = static_cast<double>(event.getProfilingInfo<CL_PROFILING_COMMAND_START>());
                const auto end = static_cast<double>(event.getProfilingInfo<CL_PROFILING_COMMAND_END>());
                profile.spans.push_back({frame, 1e-9 * (start + offset), 1e-9 * (end + offset)});
                seconds_of_frames[frame] += 1e-9 * (end - start);
            }
            std::vector<double> seconds;
            for (const auto& [frame, sum] : seconds_of_frames) seconds.push_back(sum);
            std::nth_element(seconds.begin(), seconds.begin() + seconds.size() / 2, seconds.end());
            profile.seconds = seconds[seconds.size() / 2];
            profiles.push_back(std::move(profile));
            stage.launches.clear();
        }
    });
    frame_ = -1;
    return profiles;
}

}  // namespace clarus::runtime
