#include "io/encode.h"

#include <algorithm>

#include "io/qrisp.h"

namespace clarus::io {
namespace {

/// What a depth buffer holds at the canonical depth d.
double projected(double d, double near, double far, bool reversed) {
    const double z = std::max(d * far, near);
    return reversed ? near * (far - z) / (z * (far - near)) : far * (z - near) / (z * (far - near));
}

}  // namespace

Pixels encode_depth(const Pixels& canonical, const Sequence& sequence, const FrameFiles& frame) {
    if (sequence.depth_storage == DepthStorage::packed_rgba8) return pack_depth(canonical);
    Pixels stored = canonical;
    const auto [projective, reversed] = sequence.depth;
    for (float& value : stored.values) {
        const double d = std::clamp(value, 0.0f, 1.0f);
        const double v = projective ? projected(d, frame.near_plane, frame.far_plane, reversed) : reversed ? 1 - d : d;
        value = static_cast<float>(v);
    }
    return stored;
}

Pixels encode_motion(const Pixels& canonical, const Sequence& sequence, const FrameFiles& frame, Vec2 jitter,
                     Vec2 previous_jitter) {
    const Vec2 scale = sequence.motion_scale(frame);
    // What readers add.
    const Vec2 compensation =
        sequence.motion.jittered ? Vec2{previous_jitter.x - jitter.x, previous_jitter.y - jitter.y} : Vec2{};
    Pixels stored = canonical;
    for (size_t i = 0; i + 1 < stored.values.size(); i += 2) {
        stored.values[i] = (canonical.values[i] - compensation.x) / scale.x;
        stored.values[i + 1] = (canonical.values[i + 1] - compensation.y) / scale.y;
    }
    return stored;
}

}  // namespace clarus::io
