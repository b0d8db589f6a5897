#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "bench/suite.h"
#include "cl/context.h"

namespace clarus::bench {
namespace {

UpscalerOptions profiled(UpscalerOptions options) {
    options.profile = true;
    return options;
}

}  // namespace

FrameBench::FrameBench(const Device& device, std::string name, const Model& model, Size render,
                       const UpscalerOptions& options)
    : name_(std::move(name)), upscaler_(device, model, render, profiled(options)) {
    upscaler_.prepare();
    const auto image = [&](Size size, int channels, float value) {
        const size_t bytes = static_cast<size_t>(size.width) * size.height * channels * sizeof(float);
        const auto buffer = std::make_shared<cl::Buffer>(device.context().context(), CL_MEM_READ_WRITE, bytes);
        device.context().queue().enqueueFillBuffer(*buffer, value, 0, bytes);
        buffers_.push_back(buffer);
        return Image{.buffer = (*buffer)(), .size = size};
    };
    frame_.color = image(render, 3, 0.5f);
    frame_.depth = image(render, 1, 0.5f);
    frame_.motion = image(render, 2, 1.3f);
    frame_.output = image(upscaler_.output_size(), 3, 0);
}

std::string FrameBench::size() const {
    const Size size = upscaler_.output_size();
    return fmt::format("{}×{}, ×{}", size.width, size.height, size.width / upscaler_.render_size().width);
}

double FrameBench::run() {
    upscaler_.submit(frame_).wait();
    double start = 0, end = 0;
    for (const StageProfile& stage : upscaler_.take_profile()) {
        for (const StageProfile::Span& span : stage.spans) {
            start = start == 0 ? span.start : std::min(start, span.start);
            end = std::max(end, span.end);
        }
        const auto known = std::find_if(stages_.begin(), stages_.end(),
                                        [&](const auto& other) { return other.first.name == stage.name; });
        auto& [profile, seconds] = known == stages_.end() ? stages_.emplace_back(stage, std::vector<double>()) : *known;
        seconds.push_back(stage.seconds);
    }
    return end - start;
}

std::vector<StageProfile> FrameBench::stages() {
    std::vector<StageProfile> result;
    for (auto& [stage, seconds] : std::exchange(stages_, {})) {
        std::nth_element(seconds.begin(), seconds.begin() + seconds.size() / 2, seconds.end());
        stage.seconds = seconds[seconds.size() / 2];
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
