#pragma once

#include <Imath/ImathVec.h>

#include "clarus/stream.h"
#include "clarus/types.h"

namespace clarus::render {

/// Where a camera stands and looks. World: metres, y up, right-handed. Angles in radians; all zero looks along −z.
struct CameraPose {
    Imath::V3d position{0, 1.6, 0};
    double yaw = 0;    // to the right
    double pitch = 0;  // upwards
    double roll = 0;   // clockwise as seen by the camera
    double fov_y = 1;  // vertical field of view
};

/// A pinhole camera without jitter. Pixel coordinates are those of docs/conventions.md, "Image grid", at render
/// resolution: origin top-left, y down, (0.5, 0.5) the first pixel's centre.
class Camera {
  public:
    Camera(const CameraPose& pose, Size render_size);

    const Imath::V3d& position() const { return position_; }
    const Imath::V3d& forward() const { return forward_; }

    /// Through a pixel position; its component along `forward` is 1, so that ray lengths are view distances.
    Imath::V3d direction(const Imath::V2d& pixel) const;
    /// How that direction changes from a pixel to the next one on its right, and to the next one below.
    Imath::V3d step_right() const { return right_ / focal_; }
    Imath::V3d step_down() const { return -up_ / focal_; }

    double view_distance(const Imath::V3d& point) const { return (point - position_) ^ forward_; }
    /// Of a point with a view distance above 0.
    Imath::V2d project(const Imath::V3d& point) const { return project_direction(point - position_); }
    /// Of a point infinitely far away in front of the camera.
    Imath::V2d project_direction(const Imath::V3d& direction) const;

    /// For column vectors: clip = projection · view · world. View space looks along −z with y up; clip space has y up
    /// and, after division, depth 0 at the near plane and 1 at the far one, or where `reversed` 1 and 0.
    FrameDescription::Camera matrices(double near_plane, double far_plane, bool reversed) const;

  private:
    Imath::V3d position_, forward_, right_, up_;
    Imath::V2d center_;
    double focal_;  // pixels
};

}  // namespace clarus::render
