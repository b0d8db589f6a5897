#include "measure/timed_upscaler.h"

#include <algorithm>
#include <chrono>
#include <map>
#include <utility>

#include "cl/context.h"
#include "cl/error.h"
#include "measure/statistics.h"

namespace clarus::measure {
namespace {

UpscalerOptions profiled(UpscalerOptions options) {
    options.profile = true;
    return options;
}

}  // namespace

double now() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

DeviceSequence::DeviceSequence(const Device& device, Size render) {
    ocl::checked("upload the test sequence", [&] {
        const auto uploaded = [&](std::vector<float>& values) {
            const auto buffer =
                std::make_shared<cl::Buffer>(device.context().context(), CL_MEM_READ_ONLY | CL_MEM_COPY_HOST_PTR,
                                             values.size() * sizeof(float), values.data());
            buffers_.push_back(buffer);
            return Image{.buffer = (*buffer)(), .size = render};
        };
        for (int index = 0; index < kSequenceFrames; ++index) {
            TestFrame frame = test_frame(render, index);
            FrameDescription description;
            description.color = uploaded(frame.color);
            description.depth = uploaded(frame.depth);
            description.motion = uploaded(frame.motion);
            description.jitter = frame.jitter;
            description.reset = index == 0;
            frames_.push_back(description);
        }
    });
}

std::shared_ptr<const DeviceSequence> DeviceSequences::of(const Device& device, Size render) {
    auto& known = sequences_[{device.profile().selector, render.width, render.height}];
    auto sequence = known.lock();
    if (!sequence) known = sequence = std::make_shared<DeviceSequence>(device, render);
    return sequence;
}

TimedUpscaler::TimedUpscaler(const Device& device, const Model& model, Size render, UpscalerOptions options)
    : device_(device), upscaler_(device, model, render, profiled(std::move(options))) {}

void TimedUpscaler::prepare(DeviceSequences& sequences) {
    sequence_ = sequences.of(device_, render_size());
    upscaler_.prepare();
    output_ = ocl::checked("allocate the output", [&] {
        const size_t bytes = 3 * sizeof(float) * output_size().width * output_size().height;
        return std::make_shared<cl::Buffer>(device_.context().context(), CL_MEM_READ_WRITE, bytes);
    });
}

FrameEvent TimedUpscaler::submit(int index) {
    FrameDescription frame = sequence_->frame(index);
    frame.output = {.buffer = (*std::static_pointer_cast<cl::Buffer>(output_))(), .size = output_size()};
    return upscaler_.submit(frame);
}

void TimedUpscaler::run(int index) { submit(index).wait(); }

Turn TimedUpscaler::turn() {
    Turn turn;
    run(0);
    take_stages();
    for (int index = 1; index < kSequenceFrames; ++index) {
        const double start = now();
        run(index);
        turn.latencies.push_back(now() - start);
    }
    turn.stages = take_stages();
    turn.device_seconds = median(frame_seconds(turn.stages));

    run(0);
    const double start = now();
    for (int index = 1; index + 1 < kSequenceFrames; ++index) submit(index);
    run(kSequenceFrames - 1);
    turn.frames_per_second = (kSequenceFrames - 1) / (now() - start);
    take_stages();
    return turn;
}

std::vector<float> TimedUpscaler::output() const {
    std::vector<float> pixels(size_t{3} * output_size().width * output_size().height);
    ocl::checked("read the output", [&] {
        device_.context().queue().enqueueReadBuffer(*std::static_pointer_cast<cl::Buffer>(output_), CL_TRUE, 0,
                                                    pixels.size() * sizeof(float), pixels.data());
    });
    return pixels;
}

std::vector<double> frame_seconds(const std::vector<StageProfile>& stages) {
    std::map<int, std::pair<double, double>> frames;  // start, end
    for (const StageProfile& stage : stages) {
        for (const StageProfile::Span& span : stage.spans) {
            auto& [start, end] = frames.try_emplace(span.frame, span.start, span.end).first->second;
            start = std::min(start, span.start);
            end = std::max(end, span.end);
        }
    }
    std::vector<double> seconds;
    for (const auto& [frame, times] : frames) seconds.push_back(times.second - times.first);
    return seconds;
}

}  // namespace clarus::measure
