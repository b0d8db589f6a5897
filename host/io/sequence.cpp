#include "io/sequence.h"

#include <algorithm>
#include <cmath>

namespace clarus::io {

bool Sequence::is_dynamic() const {
    return std::any_of(frames.begin(), frames.end(),
                       [&](const FrameFiles& frame) { return render_size_of(frame) != render_size; });
}

bool Sequence::any_has(const std::string& optional) const {
    return std::any_of(frames.begin(), frames.end(),
                       [&](const FrameFiles& frame) { return frame.optional.contains(optional); });
}

MotionEncoding Sequence::motion_encoding() const {
    return {.scale = motion_scale({}), .jittered = motion.jittered, .sampled_at_jitter = motion.sampled_at_jitter};
}

Vec2 Sequence::motion_scale(const FrameFiles& frame) const {
    const bool uv = motion.unit == MotionUnit::uv;
    const Size size = render_size_of(frame);
    const float direction = motion.from_previous ? -1 : 1;
    return {direction * (uv ? size.width : 1), direction * (uv ? size.height : 1) * (motion.y_up ? -1 : 1)};
}

double Sequence::output_scale() const {
    if (!shown_size) return scale;
    const double across = static_cast<double>(shown_size->width) / render_size.width;
    return std::sqrt(across * shown_size->height / render_size.height);
}

}  // namespace clarus::io
