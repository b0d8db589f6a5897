#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "clarus/upscaler.h"
#include "measure/timed_upscaler.h"
#include "measure/work.h"

namespace clarus::bench {

using measure::Work;

/// The most that `clpeak` reaches in single precision on this device, in operations a second; 0 where it is not
/// installed.
double clpeak_peak(const Device& device);

/// Every convolution implementation but the obvious one, with its built-in choices, 3×3 at 960×540.
std::vector<Work> convolution_items(const Device& device);

/// A frame of the sample renderer's demo scene with its reference, on one core.
struct RenderItem {
    Work work;
    double rays;  // that are shaded
};
RenderItem render_item();

/// A model's frames, images on the device.
class FrameBench {
  public:
    FrameBench(const Device& device, std::string name, const Model& model, Size render,
               measure::DeviceSequences& sequences, const UpscalerOptions& options = {});

    const std::string& name() const { return name_; }
    std::string size() const;  // "1920×1080, ×2"
    /// One frame; seconds from the first stage's start to the last one's end.
    double run();
    /// Stages of all frames so far, medians; empties the record.
    std::vector<StageProfile> stages();
    MemoryRequirements memory() const { return upscaler_.memory(); }

  private:
    std::string name_;
    measure::TimedUpscaler upscaler_;
    int next_ = 0;                                                      // frame of the test sequence
    std::vector<std::pair<StageProfile, std::vector<double>>> stages_;  // with every frame's seconds
};

/// Whether a stage is one of the network's layers.
bool is_convolution(const StageProfile& stage);

/// NSRR's frames as the paper has them: table "1" (three output sizes, both networks), "2" (stages), "5" (previous
/// frames). Errors: invalid_argument for others.
void print_nsrr_table(const Device& device, const std::string& table);

}  // namespace clarus::bench
