#pragma once

#include <optional>
#include <vector>

#include "base/python_process.h"
#include "io/image.h"

namespace clarus::metrics {

/// VMAF (Netflix; model v0.6.1) of a sequence against its reference, from 0 to about 100 (no difference), by an FFmpeg
/// that has libvmaf: the one of PyPI's imageio-ffmpeg in the python3 in the path, or the ffmpeg in the path.
class Vmaf {
  public:
    /// Errors: invalid_argument where there is no such FFmpeg.
    Vmaf();

    /// The next frame, of display values, which are compared as 8-bit luma. Errors: as mean_squared_error;
    /// invalid_argument where the size is not that of the first one.
    void add(const io::Pixels& image, const io::Pixels& reference);

    /// After the last frame: every frame's figure, which depends on the frame before. Errors: file where FFmpeg fails.
    std::vector<double> finish();

  private:
    PythonProcess python_;
    std::optional<Size> size_;
    size_t frames_ = 0;
};

}  // namespace clarus::metrics
