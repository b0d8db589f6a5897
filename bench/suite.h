#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "clarus/upscaler.h"

namespace clarus::bench {

/// One thing to be timed. `run` does it once and returns the seconds that the device took.
struct Item {
    std::string name;
    double operations = 0;
    double bytes = 0;
    std::function<double()> run;
};

/// The multiply–add sweep over vector widths and accumulators.
std::vector<Item> peak_items(const Device& device);
/// One large copy, counting bytes read and written.
Item copy_item(const Device& device);
/// The most that `clpeak` reaches in single precision on this device, in operations a second; 0 where it is not
/// installed.
double clpeak_peak(const Device& device);

/// Every convolution implementation but the obvious one, with its built-in choices, 3×3 at 960×540.
std::vector<Item> convolution_items(const Device& device);

/// A frame of the sample renderer's demo scene with its reference, on one core.
struct RenderItem {
    Item item;
    double rays;  // that are shaded
};
RenderItem render_item();

/// An ENSS network of f features and m middle layers with random weights: time does not depend on them.
Model random_enss(int features, int middle);

/// A frame at 1920×1080 output from 960×540, images on the device.
class FrameBench {
  public:
    FrameBench(const Device& device, std::string name, Model model, Tuning tuning);

    const std::string& name() const { return name_; }
    /// One frame; seconds from the first stage's start to the last one's end.
    double run();
    /// Stages of all frames so far, medians; empties the record.
    std::vector<StageProfile> stages();
    MemoryRequirements memory() const { return upscaler_.memory_requirements(); }

  private:
    std::string name_;
    Upscaler upscaler_;
    std::vector<std::shared_ptr<void>> buffers_;
    FrameDescription frame_;
    std::vector<StageProfile> stages_;
};

}  // namespace clarus::bench
