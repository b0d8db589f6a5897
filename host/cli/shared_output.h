#pragma once

#include <optional>
#include <string>

#include "clarus/stream.h"
#include "cli/frame_source.h"
#include "cli/share_publisher.h"
#include "io/image.h"

namespace clarus::cli {

/// Upscaled frames as a stream of their own, from which another process takes them: of the size of the first, float
/// colour alone, with the number and the camera of the frame that each is of, without jitter. None is lost: where
/// nobody takes them `write` waits.
class SharedOutput {
  public:
    /// Errors: invalid_argument and file where there cannot be a stream of this name.
    explicit SharedOutput(std::string name);

    /// In the order of frames. `inputs` and `number` of what was upscaled, `seconds` after the frame before it.
    /// Nothing is written once Interrupt came. Errors: as clarus_share_open, where the first frame opens the stream.
    void write(const SourceFrame& frame, const io::Pixels& pixels, ColorSpace color_space);
    /// Waits until all frames are taken.
    void finish();

  private:
    std::string name_;
    std::optional<SharePublisher> publisher_;
};

}  // namespace clarus::cli
