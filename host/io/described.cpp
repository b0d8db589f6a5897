#include "io/described.h"

#include "base/error.h"

namespace clarus::io {

void check_described(const Sequence& sequence, bool needs_depth, bool needs_motion) {
    if (sequence.is_described || !(needs_depth || needs_motion)) return;
    const FrameFiles& first = sequence.frames.front();
    const bool is_one_image = sequence.frames.size() == 1 && !first.color.empty();
    fail(ErrorKind::file,
         "{}: images alone lack {} and jitter, which the model needs; describe them in a sequence.json "
         "(docs/formats.md), or take a model that needs colour alone, such as srpo-x2, espcn-x2 or bicubic",
         is_one_image ? first.color.string() : sequence.folder.string(),
         !needs_motion  ? "depth"
         : !needs_depth ? "motion"
                        : "depth, motion");
}

}  // namespace clarus::io
