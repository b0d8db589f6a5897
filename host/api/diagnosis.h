#pragma once

#include <future>

#include "check/warping.h"
#include "cl/context.h"
#include "clarus/upscaler.h"

namespace clarus {

/// Of UpscalerOptions::diagnose: keeps a run's first frames, and has a thread look at them for what is surely declared
/// wrongly, which the log then says, once.
class Diagnosis {
  public:
    /// `scale`: of the output.
    Diagnosis(const UpscalerOptions& options, Size render, double scale);
    /// Looks at the frames that came, where they were fewer than it wanted; waits for the end of that.
    ~Diagnosis();
    Diagnosis(const Diagnosis&) = delete;
    Diagnosis& operator=(const Diagnosis&) = delete;

    /// The next frame, which was submitted to the context's queue; nothing once it has enough. Frames that are rendered
    /// smaller end it. Errors: device.
    void add(const FrameDescription& frame, const ocl::Context& context);

  private:
    void look();

    StreamOptions options_;
    check::Film film_;
    bool is_full_ = false;
    std::future<void> looking_;
};

}  // namespace clarus
