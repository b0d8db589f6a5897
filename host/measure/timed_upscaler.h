#pragma once

#include <map>
#include <memory>
#include <string>
#include <tuple>
#include <vector>

#include "clarus/upscaler.h"
#include "measure/test_sequence.h"

namespace clarus::measure {

/// The test sequence in a device's memory.
class DeviceSequence {
  public:
    /// Errors: out_of_memory, device.
    DeviceSequence(const Device& device, Size render);

    /// Without an output. The first resets.
    const FrameDescription& frame(int index) const { return frames_[index]; }

  private:
    std::vector<std::shared_ptr<void>> buffers_;
    std::vector<FrameDescription> frames_;
};

/// Sequences of several devices and sizes, each made when it is first asked for and there as long as it is used.
class DeviceSequences {
  public:
    /// Errors: those of DeviceSequence.
    std::shared_ptr<const DeviceSequence> of(const Device& device, Size render);

  private:
    std::map<std::tuple<std::string, int, int>, std::weak_ptr<const DeviceSequence>> sequences_;
};

/// What a model did in one turn.
struct Turn {
    std::vector<double> latencies;  // seconds by the host's clock from submission to output, of every frame
    double frames_per_second = 0;   // without waiting in between
    double device_seconds = 0;      // from the first stage's start to the last one's end, median of the frames
    std::vector<StageProfile> stages;
};

/// A model upscaling the test sequence on a device, with every stage timed. Allocates when it is prepared.
class TimedUpscaler {
  public:
    /// Errors: those of Upscaler's constructor.
    TimedUpscaler(const Device& device, const Model& model, Size render, UpscalerOptions options = {});

    Size render_size() const { return upscaler_.render_size(); }
    Size output_size() const { return upscaler_.output_size(); }
    MemoryRequirements memory() const { return upscaler_.memory_requirements(); }

    /// Frames come from `sequences`. Errors: those of Upscaler::prepare and of DeviceSequence.
    void prepare(DeviceSequences& sequences);

    /// One frame of the sequence, up to its output. Needs prepare, as what follows.
    void run(int index);
    /// The stages of the frames since the last call.
    std::vector<StageProfile> take_stages() { return upscaler_.take_profile(); }

    /// The whole sequence twice: waiting for every frame, then at one go. The first frame, a cut that also wakes
    /// threads and fills caches, is not timed.
    Turn turn();

    /// The last frame's output, three channels. Errors: device.
    std::vector<float> output() const;

  private:
    FrameEvent submit(int index);

    Device device_;
    Upscaler upscaler_;
    std::shared_ptr<const DeviceSequence> sequence_;
    std::shared_ptr<void> output_;
};

/// From the first stage's start to the last one's end, a frame each.
std::vector<double> frame_seconds(const std::vector<StageProfile>& stages);

/// The host's clock, in seconds.
double now();

}  // namespace clarus::measure
