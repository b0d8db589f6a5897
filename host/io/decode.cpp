#include "io/decode.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace clarus::io {
namespace {

/// Of a depth buffer's v in [0, 1]: view distance over the far plane, or over 10⁴ near planes where that is infinite.
double linearised(double v, double near, double far, bool reversed) {
    const double toward_near = reversed ? v : 1 - v;
    if (std::isinf(far)) return 1e-4 / toward_near;
    const double ratio = near / far;
    return ratio / (ratio + toward_near * (1 - ratio));
}

}  // namespace

Pixels decode_depth(const Pixels& stored, const Sequence& sequence, const FrameFiles& frame) {
    Pixels canonical = stored;
    const auto [projective, reversed] = sequence.depth;
    for (float& value : canonical.values) {
        const double v = std::clamp<double>(value, 0, 1);
        const double d = projective ? linearised(v, frame.near_plane, frame.far_plane, reversed) : reversed ? 1 - v : v;
        value = d <= 1 ? static_cast<float>(d) : 1;  // NaN and a denominator of 0, too
    }
    return canonical;
}

Pixels decode_motion(const Pixels& stored, const Sequence& sequence, const FrameFiles& frame) {
    const Vec2 scale = sequence.motion_scale(frame);
    const Size size = sequence.render_size_of(frame);
    const float longest = std::hypot(size.width, size.height);
    Pixels canonical = stored;
    for (size_t i = 0; i + 1 < canonical.values.size(); i += 2) {
        float &x = canonical.values[i], &y = canonical.values[i + 1];
        x *= scale.x;
        y *= scale.y;
        if (!(std::hypot(x, y) <= longest)) x = y = std::numeric_limits<float>::quiet_NaN();
    }
    return canonical;
}

}  // namespace clarus::io
