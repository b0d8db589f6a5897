#pragma once

#include <Imath/ImathVec.h>

#include "render/renderer.h"

namespace clarus::render {

/// An endless walk, flight or look around on the demo scene's square. Motion comes in cycles of
/// 48 frames: 32 in which the camera moves, starting and stopping gently, and 16 in which it stands still, every other
/// time together with all objects.
class CameraPath {
  public:
    /// `number` ≥ 0 is a seed.
    explicit CameraPath(int number);

    FrameState frame(int index) const;

    /// Whether a thing of this radius at (x, z) would be in the camera's way.
    bool passes(Imath::V2d place, double radius) const;

  private:
    enum class Style { walk, fly, turn };
    CameraPose pose(double seconds) const;
    Imath::V2d place(double angle) const;

    Style style_;
    Imath::V2d center_;
    double radius_, speed_, direction_, start_, fov_y_, look_phase_, look_offset_;
    double lobe2_, lobe3_, phase2_, phase3_;
};

}  // namespace clarus::render
