#pragma once

#include <Imath/ImathVec.h>

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

/// A pinhole camera without jitter. Pixel coordinates are those of conventions.md at render resolution: origin
/// top-left, y down, (0.5, 0.5) the first pixel's centre.
class Camera {
  public:
    Camera(const CameraPose& pose, Size render_size);

    const Imath::V3d& position() const { return position_; }
    const Imath::V3d& forward() const { return forward_; }
    /// Width of a pixel at a view distance of 1.
    double pixel_width() const { return 1 / focal_; }

    /// Through a pixel position; its component along `forward` is 1, so that ray lengths are view distances.
    Imath::V3d direction(const Imath::V2d& pixel) const;
    double view_distance(const Imath::V3d& point) const { return (point - position_) ^ forward_; }
    /// Of a point with a view distance above 0.
    Imath::V2d project(const Imath::V3d& point) const { return project_direction(point - position_); }
    /// Of a point infinitely far away in front of the camera.
    Imath::V2d project_direction(const Imath::V3d& direction) const;

  private:
    Imath::V3d position_, forward_, right_, up_;
    Imath::V2d center_;
    double focal_;  // pixels
};

}  // namespace clarus::render
