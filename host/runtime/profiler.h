#pragma once

#include <string>
#include <utility>
#include <vector>

#include "cl/opencl.h"
#include "clarus/stream.h"

namespace clarus::runtime {

/// Gathers device events of every stage of every frame.
class Profiler {
  public:
    explicit Profiler(bool enabled) : enabled_(enabled) {}

    /// The stages to come are those of the same frames at another size, in the same order.
    void begin_stages() { declared_.clear(); }

    /// Declares a stage; the returned number names it. That of the same name and kernel, or the first, second, … of
    /// several, goes on after begin_stages(), with the operations and bytes that it had.
    int add_stage(std::string name, std::string kernel, double operations, double bytes);

    /// What is launched from now on belongs to the next frame.
    void begin_frame() { ++frame_; }

    /// Where the event of a stage's launch is to be put, or null where nothing is profiled.
    cl::Event* event(int stage);

    /// Waits for the frames so far and returns their times; starts anew.
    std::vector<StageProfile> take();

  private:
    struct Stage {
        StageProfile profile;
        std::vector<std::pair<int, cl::Event>> events;  // with their frames
    };

    bool enabled_;
    int frame_ = -1;  // since the last take
    std::vector<Stage> stages_;
    std::vector<int> declared_;  // since begin_stages
};

}  // namespace clarus::runtime
