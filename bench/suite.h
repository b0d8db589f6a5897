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

/// A network's frame, images on the device.
class FrameBench {
  public:
    FrameBench(const Device& device, std::string name, const Model& model, Size render,
               const UpscalerOptions& options = {});

    const std::string& name() const { return name_; }
    std::string size() const;  // "1920×1080, ×2"
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
    std::vector<std::pair<StageProfile, std::vector<double>>> stages_;  // with every frame's seconds
};

/// Whether a stage is one of the network's layers.
bool is_convolution(const StageProfile& stage);

/// The most multiply–adds, as operations a second, that `items` of peak_items reach, run one after the other.
double quick_peak(const std::vector<Item>& items);

/// NSRR's frames as the paper has them: table "1" (three output sizes, both networks), "2" (stages), "5" (previous
/// frames). Errors: invalid_argument for others.
void print_nsrr_table(const Device& device, const std::string& table);

}  // namespace clarus::bench
