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
    /// `scale`: of the output. Without `needs_depth`, depth is not looked at, for nobody has checked it.
    Diagnosis(const UpscalerOptions& options, Size render, double scale, bool needs_depth);
    /// Looks at the frames that came, where they were fewer than it wanted; waits for the end of that.
    ~Diagnosis();
    Diagnosis(const Diagnosis&) = delete;
    Diagnosis& operator=(const Diagnosis&) = delete;

    /// The next frame, which was submitted to the context's queue; nothing once it has enough. Frames that are rendered
    /// smaller end it, and what goes wrong with it does: the frame is on its way.
    void add(const FrameDescription& frame, const ocl::Context& context) noexcept;
    /// The next frame follows none.
    void cut() { is_cut_ = true; }

  private:
    void take(const FrameDescription& frame, const ocl::Context& context);
    void look();

    StreamOptions options_;
    bool needs_depth_;
    check::Film film_;
    bool is_full_ = false, is_cut_ = true;
    std::future<void> looking_;
};

}  // namespace clarus
