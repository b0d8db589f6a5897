#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "bench/suite.h"
#include "measure/statistics.h"

namespace clarus::bench {

FrameBench::FrameBench(const Device& device, std::string name, const Model& model, Size render,
                       measure::DeviceSequences& sequences, const UpscalerOptions& options)
    : name_(std::move(name)), upscaler_(device, model, render, options) {
    upscaler_.prepare(sequences);
}

std::string FrameBench::size() const {
    const Size size = upscaler_.output_size();
    return fmt::format("{}×{}, ×{}", size.width, size.height, size.width / upscaler_.render_size().width);
}

double FrameBench::run() {
    upscaler_.run(next_);
    next_ = next_ % (measure::kSequenceFrames - 1) + 1;  // only the first frame is a cut
    const std::vector<StageProfile> stages = upscaler_.take_stages();
    for (const StageProfile& stage : stages) {
        const auto known = std::find_if(stages_.begin(), stages_.end(),
                                        [&](const auto& other) { return other.first.name == stage.name; });
        auto& [profile, seconds] = known == stages_.end() ? stages_.emplace_back(stage, std::vector<double>()) : *known;
        seconds.push_back(stage.seconds);
    }
    return measure::frame_seconds(stages).front();
}

std::vector<StageProfile> FrameBench::stages() {
    std::vector<StageProfile> result;
    for (auto& [stage, seconds] : std::exchange(stages_, {})) {
        stage.seconds = measure::median(seconds);
        result.push_back(std::move(stage));
    }
    return result;
}

bool is_convolution(const StageProfile& stage) {
    for (const char* kernel : {"winograd", "direct", "tiled", "plain"})
        if (stage.kernel.starts_with(kernel)) return true;
    return false;
}

}  // namespace clarus::bench
