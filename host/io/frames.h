#pragma once

#include <cstddef>
#include <deque>
#include <future>
#include <optional>

#include "io/image.h"
#include "io/sequence.h"

namespace clarus::io {

/// What the files of a sequence's colours say of themselves.
struct ColorFiles {
    bool has_alpha = false;            // of some frame
    SampleType type = SampleType::u8;  // of the first frame
    ColorTags tags{};                  // likewise
};

/// Opens every image of every frame and compares its size and channels with what the sequence says. A frame without
/// depth or motion is refused where it is needed. Errors: file, naming the image.
ColorFiles check_sequence(const Sequence& sequence, bool needs_depth, bool needs_motion);

/// A frame's images as the files hold them: colour space, depth encoding and motion scale are converted on the device.
/// (Packed depth is unpacked.) Empty where not asked for or not there.
struct FramePixels {
    Pixels color;                                 // 3 channels, render resolution
    Pixels depth;                                 // 1
    Pixels motion;                                // 2
    Pixels reference;                             // 3, output resolution
    Pixels alpha{};                               // 1, the colour's; as stored
    Pixels reactive_mask{}, transparency_mask{};  // 1, render resolution
    Pixels opaque_color{};                        // 3, render resolution
    Pixels ui{};                                  // 4, premultiplied, of the size that is shown
};

/// Depth, masks and opaque colour come with motion. Errors: file, naming the image that does not open or whose size or
/// channels are not the sequence's.
FramePixels read_frame(const Sequence& sequence, size_t index, bool want_motion, bool want_reference);

/// Where a frame's surfaces are and were, without jitter, at the centres of output pixels.
struct GroundTruth {
    Pixels depth;   // canonical, 0 nearest
    Pixels motion;  // canonical, but in output pixels; NaN where invalid
};

/// A frame's `reference_depth` and `reference_motion` (docs/formats.md, "A frame's fields"); none where it does not
/// name both. Errors: as read_frame.
std::optional<GroundTruth> read_ground_truth(const Sequence& sequence, size_t index);

/// Reads frames [first, last) in order on threads of its own, up to `ahead` of them before they are asked for.
class FrameReader {
  public:
    FrameReader(Sequence sequence, size_t first, size_t last, bool want_motion, bool want_reference, size_t ahead = 2);
    FrameReader(const FrameReader&) = delete;
    FrameReader& operator=(const FrameReader&) = delete;

    struct Frame {
        size_t index = 0;  // into Sequence::frames
        FramePixels pixels;
    };
    /// The next frame; none after the last. Waits. Errors: what read_frame threw, at its frame; then none.
    std::optional<Frame> next();

  private:
    void fill();

    const Sequence sequence_;
    size_t next_, last_;
    const bool want_motion_, want_reference_;
    const size_t ahead_;
    // Last: a future waits for its reader when it is destroyed, and readers use what is above.
    std::deque<std::future<Frame>> pending_;
};

}  // namespace clarus::io
