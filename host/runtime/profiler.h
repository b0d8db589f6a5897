#pragma once

#include <chrono>
#include <deque>
#include <string>
#include <vector>

#include "cl/opencl.h"
#include "clarus/stream.h"

namespace clarus::runtime {

/// Gathers the events of every stage of every frame, of one device.
class Profiler {
  public:
    explicit Profiler(bool enabled) : enabled_(enabled) {}

    /// The stages to come are those of the same frames at another size, in the same order.
    void begin_stages() { declared_.clear(); }

    /// Declares a stage; the returned number names it. That of the same name and kernel, or the first, second, … of
    /// several, goes on after begin_stages(), with the operations and bytes that it had.
    int add_stage(std::string name, std::string kernel, double operations, double bytes);

    /// Times are of so many frames, the last ones: what is kept of a stage does not grow with a run.
    static constexpr int kFramesKept = 1000;

    /// What is launched from now on belongs to the next frame.
    void begin_frame();

    /// Where the event of a stage's launch is to be put, or null where nothing is profiled. To be asked for right
    /// before the launch: the moment relates the device's clock to the host's.
    cl::Event* event(int stage);

    /// Waits for the frames so far and returns their times; starts anew.
    std::vector<StageProfile> take();

  private:
    struct Launch {
        int frame;
        std::chrono::steady_clock::time_point asked_for;
        cl::Event event;
    };
    struct Stage {
        StageProfile profile;
        std::deque<Launch> launches;
    };

    /// What is to be added to the device's times, in nanoseconds, to be the host's.
    double clock_offset() const;

    bool enabled_;
    int frame_ = -1;  // since the last take
    std::vector<Stage> stages_;
    std::vector<int> declared_;  // since begin_stages
};

}  // namespace clarus::runtime
