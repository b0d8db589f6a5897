#include "render/camera.h"

#include <array>
#include <cmath>

namespace clarus::render {

Camera::Camera(const CameraPose& pose, Size render_size)
    : position_(pose.position),
      center_(render_size.width / 2.0, render_size.height / 2.0),
      focal_(center_.y / std::tan(pose.fov_y / 2)) {
    const double cos_pitch = std::cos(pose.pitch);
    forward_ = {std::sin(pose.yaw) * cos_pitch, std::sin(pose.pitch), -std::cos(pose.yaw) * cos_pitch};
    const Imath::V3d level_right(std::cos(pose.yaw), 0, std::sin(pose.yaw));
    const Imath::V3d level_up = level_right % forward_;
    right_ = level_right * std::cos(pose.roll) - level_up * std::sin(pose.roll);
    up_ = level_up * std::cos(pose.roll) + level_right * std::sin(pose.roll);
}

Imath::V3d Camera::direction(const Imath::V2d& pixel) const {
    const Imath::V2d offset = (pixel - center_) / focal_;
    return forward_ + right_ * offset.x - up_ * offset.y;
}

Imath::V2d Camera::project_direction(const Imath::V3d& direction) const {
    const double scale = focal_ / (direction ^ forward_);
    return center_ + Imath::V2d(direction ^ right_, -(direction ^ up_)) * scale;
}

FrameDescription::Camera Camera::matrices(double near_plane, double far_plane, bool reversed) const {
    FrameDescription::Camera camera;
    camera.near_plane = static_cast<float>(near_plane);
    camera.far_plane = static_cast<float>(far_plane);
    camera.fov_y = static_cast<float>(2 * std::atan(center_.y / focal_));

    const std::array axes{right_, up_, -forward_};
    for (size_t row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column)
            camera.view[4 * row + column] = static_cast<float>(axes[row][column]);
        camera.view[4 * row + 3] = static_cast<float>(-(axes[row] ^ position_));
    }
    camera.view[15] = 1;

    // Depth is a + b / z at the view distance z: 0 at one plane, 1 at the other.
    const double zero = reversed ? far_plane : near_plane, one = reversed ? near_plane : far_plane;
    const double a = one / (one - zero), b = -a * zero;
    camera.projection[0] = static_cast<float>(focal_ / center_.x);
    camera.projection[5] = static_cast<float>(focal_ / center_.y);
    camera.projection[10] = static_cast<float>(-a);
    camera.projection[11] = static_cast<float>(b);
    camera.projection[14] = -1;
    return camera;
}

}  // namespace clarus::render
