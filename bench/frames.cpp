#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <utility>

#include "bench/random_model.h"
#include "bench/suite.h"
#include "cl/context.h"

namespace clarus::bench {
namespace {

constexpr Size kRender{960, 540};
constexpr int kScale = 2;

UpscalerOptions options(Tuning tuning) {
    UpscalerOptions options;
    options.tuning = tuning;
    options.profile = true;
    return options;
}

}  // namespace

Model random_enss(int features, int middle) {
    std::string name = (std::filesystem::temp_directory_path() / "clarus-bench-XXXXXX").string();
    const std::filesystem::path folder = mkdtemp(name.data());
    const std::filesystem::path file = folder / "random.safetensors";
    write_random_enss(file, kScale, features, middle);
    Model model = Model::load(file.string());
    std::filesystem::remove_all(folder);
    return model;
}

FrameBench::FrameBench(const Device& device, std::string name, Model model, Tuning tuning)
    : name_(std::move(name)), upscaler_(device, std::move(model), kRender, options(tuning)) {
    upscaler_.prepare();
    const auto image = [&](Size size, int channels, float value) {
        const size_t bytes = static_cast<size_t>(size.width) * size.height * channels * sizeof(float);
        const auto buffer = std::make_shared<cl::Buffer>(device.context().context(), CL_MEM_READ_WRITE, bytes);
        device.context().queue().enqueueFillBuffer(*buffer, value, 0, bytes);
        buffers_.push_back(buffer);
        return Image{.buffer = (*buffer)(), .size = size};
    };
    frame_.color = image(kRender, 3, 0.5f);
    frame_.depth = image(kRender, 1, 0.5f);
    frame_.motion = image(kRender, 2, 1.3f);
    frame_.output = image(upscaler_.output_size(), 3, 0);
}

double FrameBench::run() {
    upscaler_.submit(frame_).wait();
    double start = 0, end = 0;
    for (const StageProfile& stage : upscaler_.take_profile()) {
        const auto [first, last] = stage.spans.front();
        start = start == 0 ? first : std::min(start, first);
        end = std::max(end, last);
        const auto known = std::find_if(stages_.begin(), stages_.end(),
                                        [&](const StageProfile& other) { return other.name == stage.name; });
        if (known == stages_.end())
            stages_.push_back(stage);
        else
            known->spans.push_back(stage.spans.front());
    }
    return end - start;
}

std::vector<StageProfile> FrameBench::stages() {
    for (StageProfile& stage : stages_) {
        std::vector<double> seconds;
        for (const auto& [start, end] : stage.spans) seconds.push_back(end - start);
        std::nth_element(seconds.begin(), seconds.begin() + seconds.size() / 2, seconds.end());
        stage.seconds = seconds[seconds.size() / 2];
    }
    return std::exchange(stages_, {});
}

}  // namespace clarus::bench
