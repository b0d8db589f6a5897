#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "clarus/device.h"
#include "clarus/model.h"
#include "clarus/upscaler.h"
#include "cli/frame_loop.h"
#include "metrics/quality.h"

namespace clarus::cli {

/// What `clarus upscale` has to say when it is done.
struct RunReport {
    std::filesystem::path sequence;
    Model model;
    std::vector<DeviceProfile> devices;
    std::vector<PlacedPart> placement;  // empty of one device
    UpscalerOptions options;
    Size render_size, output_size;
    MemoryRequirements memory;
    int programs_compiled = 0;  // kernels' programs that no cache had
    double prepare_seconds = 0;
    double frames_seconds = 0;           // from the first frame's reading to the last one's writing
    double largest_jitter_distance = 0;  // Upscaler::largest_jitter_distance
    std::vector<FrameResult> frames;
    std::vector<StageProfile> stages;  // empty unless options.profile

    /// Over the frames that have a reference; none where no frame has one.
    std::optional<metrics::SequenceQuality> quality() const;

    /// A device's time a frame: the sum of its stages; 0 without them. −1: that of transfers.
    double device_seconds_per_frame(int device) const;

    /// Sizes in pixels, memory in bytes. Errors: file.
    void write_json(const std::filesystem::path& path) const;

    void print_summary() const;  // to stdout; what is wrong with the input as warnings in the log
    void print_stages() const;   // to stdout: a row a stage

  private:
    void warn_of_input() const;
};

}  // namespace clarus::cli
