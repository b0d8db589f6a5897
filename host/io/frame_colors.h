#pragma once

extern "C" {
#include <libavutil/frame.h>
#include <libavutil/pixdesc.h>
}

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "io/image.h"

namespace clarus::io {

// FFmpeg's frames as display values: for the module alone.

/// Why colours of this kind are not read, for a message; empty where they are (docs/formats.md, "A video").
std::string why_unread(const AVFrame& frame);

/// Converts frames, of which why_unread says nothing, as docs/formats.md, "A video", has it.
class FrameColors {
  public:
    /// 3 channels in [0, 1].
    Pixels convert(const AVFrame& frame);

  private:
    struct Plane {
        int width = 0, height = 0;
        std::vector<float> values;  // 0…1 of luma and RGB; chroma around 0
    };

    void read(const AVFrame& frame, int component);
    /// The row of a component at a picture's row, interpolated to the picture's width.
    void spread(const AVFrame& frame, int component, int y, std::vector<float>& row) const;

    std::array<Plane, 3> planes_;
    std::vector<unsigned> line_;
};

}  // namespace clarus::io
