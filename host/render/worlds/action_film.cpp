#include "render/worlds/action_film.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "render/worlds/action_actors.h"
#include "render/worlds/shots.h"

namespace clarus::render {
namespace {

using Imath::V3d;

constexpr double pi = std::numbers::pi;

Shot any_shot(Random& random) {
    const V3d eye = action_eye + V3d{random.uniform(-0.6, 0.6), random.uniform(-0.4, 0.4), random.uniform(-0.3, 0.2)};
    const V3d at{random.uniform(-0.8, 0.8), random.uniform(1.3, 2.1), -3};
    const double fov = action_fov_y * random.uniform(0.85, 1.15), phase = random.uniform(0, 2 * pi);
    const double pace = random.uniform(1.5, 5), size = random.uniform(0.1, 0.45);
    const Shot still = [=](double) { return looking(eye, at, fov); };
    switch (random.below(6)) {
        case 0:
        case 1:
            return still;
        case 2:
            return [=](double seconds) {  // turns to and fro
                CameraPose pose = looking(eye, at, fov);
                pose.yaw += size * std::sin(pace * seconds + phase);
                pose.pitch += 0.25 * size * std::sin(1.4 * pace * seconds + phase);
                return pose;
            };
        case 3:
            return [=](double seconds) {  // rolls past
                const V3d moved = eye + V3d(2.5 * size * std::sin(pace * seconds + phase), 0,
                                            0.6 * size * std::sin(0.7 * pace * seconds));
                CameraPose pose = looking(eye, at, fov);
                pose.position = moved;
                return pose;
            };
        case 4:
            return hand_held(random, still, random.uniform(1, 4));
        default:
            return [=](double seconds) {  // on an arc
                const V3d middle(at.x, at.y, -1);
                const double turn = size * std::sin(pace * seconds + phase);
                const V3d arm = eye - middle;
                const V3d turned(arm.x * std::cos(turn) + arm.z * std::sin(turn), arm.y,
                                 arm.z * std::cos(turn) - arm.x * std::sin(turn));
                return looking(middle + turned, middle, fov);
            };
    }
}

}  // namespace

ActionFilm::ActionFilm(Random& random) {
    constexpr std::array rates = {15, 24, 24, 30, 30, 30, 30, 60, 120};
    step_ = 1.0 / rates[static_cast<size_t>(random.below(static_cast<int>(rates.size())))];
    things_stop_ = random.below(4) > 0;
    camera_stops_ = random.below(2) == 0;
    braking_frames_ = std::array{0, 2, 6}[static_cast<size_t>(random.below(3))];
    if (random.below(6) == 0) {
        cut_frame_ = 12 + random.below(8);
        cut_flagged_ = random.below(2) == 0;
    }
    first_ = any_shot(random);
    second_ = any_shot(random);
}

double ActionFilm::clock(int frame, bool stops) const {
    if (!stops) return frame * step_;
    // Seconds that pass in the first frames of a turn: full ones, then braking, then none.
    const auto in_turn = [&](int frames) {
        double passed = 0;
        for (int i = 0; i < std::min(frames, moving_frames); ++i)
            passed += std::min(1.0, (moving_frames - i) / (braking_frames_ + 1.0));
        return passed;
    };
    const int turn = static_cast<int>(std::floor(static_cast<double>(frame) / turn_frames));
    return step_ * (turn * in_turn(turn_frames) + in_turn(frame - turn * turn_frames));
}

const Shot& ActionFilm::shot_at(int frame) const {
    if (cut_frame_ == 0) return first_;
    const int cuts = (frame + turn_frames - cut_frame_) / turn_frames;
    return cuts % 2 ? second_ : first_;
}

FrameState ActionFilm::operator()(int frame) const {
    const Shot& shot = shot_at(frame);
    const bool cut = frame > 0 && cut_flagged_ && cut_frame_ > 0 && frame % turn_frames == cut_frame_;
    const CameraPose pose = shot(clock(frame, camera_stops_));
    const Shot& shot_before = frame > 0 ? shot_at(frame - 1) : shot;
    return {pose, cut ? pose : shot_before(clock(frame - 1, camera_stops_)), clock(frame, things_stop_),
            clock(frame - 1, things_stop_), cut};
}

}  // namespace clarus::render
