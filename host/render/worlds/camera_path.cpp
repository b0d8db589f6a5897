#include "render/worlds/camera_path.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "render/random.h"
#include "render/worlds/beat.h"

namespace clarus::render {
namespace {

constexpr double pi = std::numbers::pi;
// The first frame is in full motion, so that short sequences have some.
constexpr int first_frame_in_cycle = 8;

struct Clocks {
    double camera, objects;  // seconds
};

Clocks clocks(int frame) {
    const int shifted = frame + first_frame_in_cycle;
    const int cycle = shifted / cycle_frames, in_cycle = shifted % cycle_frames;
    // Objects stand still in the still stretches of even cycles.
    const int stopped_before = (cycle + 1) / 2 * still_frames;
    const int stopped_now = cycle % 2 == 0 ? std::max(0, in_cycle - moving_frames) : 0;
    return {cycle * eased_seconds(moving_frames) + eased_seconds(std::min(in_cycle, moving_frames)),
            (shifted - stopped_before - stopped_now) * time_step};
}

}  // namespace

CameraPath::CameraPath(int number) {
    Random random(static_cast<uint64_t>(number) * 2 + 1);
    style_ = std::array{Style::walk, Style::fly, Style::turn}[static_cast<size_t>(number % 3)];
    center_ = {random.uniform(-3, 3), random.uniform(-3, 3)};
    radius_ = random.uniform(8, 13);
    direction_ = random.below(2) ? 1 : -1;
    start_ = random.uniform(0, 2 * pi);
    fov_y_ = random.uniform(48, 66) * pi / 180;
    look_phase_ = random.uniform(0, 2 * pi);
    look_offset_ = random.uniform(-0.5, 0.5);
    lobe2_ = random.uniform(0, 0.18);
    lobe3_ = random.uniform(0, 0.12);
    phase2_ = random.uniform(0, 2 * pi);
    phase3_ = random.uniform(0, 2 * pi);
    const double pace = random.uniform(0.7, 1.4);
    speed_ = pace * (style_ == Style::walk ? 2.4 : style_ == Style::fly ? 7 : 0.5);
}

Imath::V2d CameraPath::place(double angle) const {
    const double radius =
        radius_ * (1 + lobe2_ * std::sin(2 * angle + phase2_) + lobe3_ * std::sin(3 * angle + phase3_));
    return center_ + Imath::V2d(std::cos(angle), std::sin(angle)) * radius;
}

CameraPose CameraPath::pose(double t) const {
    const double angle = start_ + direction_ * speed_ / radius_ * t;
    const Imath::V2d here = place(angle), ahead = place(angle + direction_ * 0.01) - here;
    const double tangent = std::atan2(ahead.x, -ahead.y);
    CameraPose pose;
    pose.fov_y = fov_y_;
    switch (style_) {
        case Style::walk:
            pose.position = {here.x, 1.65 + 0.03 * std::sin(11 * t), here.y};
            pose.yaw = tangent + look_offset_ + 0.6 * std::sin(0.9 * t + look_phase_);
            pose.pitch = -0.08 + 0.09 * std::sin(0.7 * t + look_phase_);
            break;
        case Style::fly:
            pose.position = {here.x, 5 - 2.5 * std::cos(0.5 * t + look_phase_), here.y};
            pose.yaw = tangent + look_offset_ + 0.5 * std::sin(0.6 * t + look_phase_);
            pose.pitch = -0.3 + 0.12 * std::sin(0.8 * t);
            pose.roll = 0.12 * std::sin(0.7 * t + look_phase_);
            break;
        case Style::turn:
            pose.position = {here.x, 1.7 + 0.1 * std::sin(1.1 * t), here.y};
            pose.yaw = tangent + look_offset_ + direction_ * 0.9 * t + 0.3 * std::sin(1.7 * t + look_phase_);
            pose.pitch = -0.05 + 0.12 * std::sin(0.9 * t + look_phase_);
            break;
    }
    return pose;
}

FrameState CameraPath::frame(int index) const {
    const Clocks now = clocks(index), before = clocks(index - 1);
    return {pose(now.camera), pose(before.camera), now.objects, before.objects};
}

bool CameraPath::passes(Imath::V2d spot, double radius) const {
    for (int i = 0; i < 256; ++i) {
        if ((place(i * 2 * pi / 256) - spot).length() < radius + 0.8) return true;
    }
    return false;
}

}  // namespace clarus::render
