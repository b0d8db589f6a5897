#pragma once

#include <memory>

#include "measure/bench.h"
#include "measure/timed_upscaler.h"

namespace clarus::measure {

/// One item while it is measured: what its turns gave so far.
class ItemRun {
  public:
    /// Plans. `expected` may be null. All outlive this. Errors: those of Upscaler's constructor.
    ItemRun(const BenchItem& item, Tuning tuning, const Sketch* expected, ItemResult& result);

    /// Device memory with the images, in bytes.
    size_t memory() const;
    const BenchItem& item() const { return item_; }
    ItemResult& result() { return result_; }

    /// Errors: build, out_of_memory, device.
    void prepare(DeviceSequences& sequences) { upscaler_.prepare(sequences); }

    /// One turn; the run began at `start`. Errors: device.
    void take_turn(double start);
    /// Of the last turn's image. Errors: device.
    void check_image();

    bool is_wrong() const { return result_.check.result == Check::Result::failed; }
    bool is_steady() const { return summarise(latencies_).steady; }
    int turns() const { return static_cast<int>(turns_.size()); }
    double seconds() const { return seconds_; }  // of all turns and checks

    /// Makes the score of what was measured, unless the image was wrong.
    void finish();

  private:
    struct Stage {
        StageResult result;
        std::vector<double> seconds;
    };

    void add(const Turn& turn, double start);

    const BenchItem& item_;
    const Sketch* expected_;
    ItemResult& result_;
    TimedUpscaler upscaler_;
    double seconds_ = 0;
    std::vector<double> frames_;                              // of all turns
    std::vector<double> latencies_, rates_, device_seconds_;  // one a turn
    std::vector<Stage> stages_;
    std::vector<TurnResult> turns_;
};

}  // namespace clarus::measure
