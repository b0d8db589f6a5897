#include "render/camera.h"

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

}  // namespace clarus::render
