#include "cli/frame_description.h"

namespace clarus::cli {

Image image_of(io::Pixels& pixels) {
    return pixels.values.empty() ? Image{} : Image{.host = pixels.values.data(), .size = pixels.size};
}

FrameDescription describe_frame(const io::Sequence& sequence, const io::FrameFiles& frame, io::FramePixels& pixels) {
    FrameDescription result;
    static_cast<FrameParameters&>(result) = frame;
    result.render_size = sequence.render_size_of(frame);
    result.motion_scale = sequence.motion_scale(frame);
    result.color = image_of(pixels.color);
    result.depth = image_of(pixels.depth);
    result.motion = image_of(pixels.motion);
    result.reactive_mask = image_of(pixels.reactive_mask);
    result.transparency_mask = image_of(pixels.transparency_mask);
    result.opaque_color = image_of(pixels.opaque_color);
    result.ui = image_of(pixels.ui);
    return result;
}

}  // namespace clarus::cli
