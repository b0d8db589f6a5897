#include "render/worlds/shots.h"

#include <array>
#include <cmath>
#include <numbers>

#include "render/worlds/probe.h"

namespace clarus::render {
namespace {

using Imath::V2d;
using Imath::V3d;

constexpr double pi = std::numbers::pi;

/// A wavering value around 0, mostly within ±1: three sines that do not fit together.
class Waver {
  public:
    Waver(Random& random, double cycles_a_second) {
        for (size_t i = 0; i < waves_.size(); ++i) {
            const double pace = std::array{1.0, 1.73, 3.1}[i] * cycles_a_second * random.uniform(0.8, 1.25);
            waves_[i] = {2 * pi * pace, random.uniform(0, 2 * pi), std::array{0.6, 0.35, 0.15}[i]};
        }
    }
    double operator()(double seconds) const {
        double sum = 0;
        for (const Wave& wave : waves_) sum += wave.size * std::sin(wave.pace * seconds + wave.phase);
        return sum;
    }

  private:
    struct Wave {
        double pace, phase, size;
    };
    std::array<Wave, 3> waves_;
};

double any_fov(Random& random) { return random.uniform(42, 72) * pi / 180; }

/// One of the stage's ways, or any.
Way roam(const Scene& scene, Random& random, const Stage& stage) {
    if (!stage.ways.empty() && random.below(4)) {
        return stage.ways[static_cast<size_t>(random.below(static_cast<int>(stage.ways.size())))];
    }
    const V2d center = stage.center + V2d(random.uniform(-0.3, 0.3), random.uniform(-0.3, 0.3)) * stage.reach;
    const Loop loop = Loop::any(random, center, stage.reach * random.uniform(0.25, 0.75));
    return along(loop, [&, last = 0.0](const V2d& at) mutable {
        return last = ground_below(scene, {at.x, stage.look_from, at.y}).value_or(last);
    });
}

}  // namespace

CameraPose looking(const V3d& eye, const V3d& at, double fov_y) {
    const V3d ahead = at - eye;
    CameraPose pose;
    pose.position = eye;
    pose.yaw = std::atan2(ahead.x, -ahead.z);
    pose.pitch = std::atan2(ahead.y, std::hypot(ahead.x, ahead.z));
    pose.fov_y = fov_y;
    return pose;
}

Shot hand_held(Random& random, Shot shot, double strength) {
    const std::array sway = {Waver(random, 0.5), Waver(random, 0.7), Waver(random, 0.45)};
    const std::array tremble = {Waver(random, 1.1), Waver(random, 1.3), Waver(random, 0.8)};
    return [=, shot = std::move(shot)](double seconds) {
        CameraPose pose = shot(seconds);
        pose.position += V3d(sway[0](seconds), 0.6 * sway[1](seconds), sway[2](seconds)) * (0.04 * strength);
        pose.yaw += 0.02 * strength * tremble[0](seconds);
        pose.pitch += 0.015 * strength * tremble[1](seconds);
        pose.roll += 0.012 * strength * tremble[2](seconds);
        return pose;
    };
}

Shot follow(Random& random, const V3d& eye, const Target& target) {
    const double fov = random.uniform(18, 45) * pi / 180;
    const Waver aside(random, 0.3), above(random, 0.4);
    return [=](double seconds) {
        CameraPose pose = looking(eye, target(seconds), fov);
        pose.yaw += 0.08 * fov * aside(seconds);
        pose.pitch += 0.06 * fov * above(seconds);
        return pose;
    };
}

Shot walk(Random& random, const Way& way, double start_metres, double start_seconds, double pace) {
    const double fov = any_fov(random), eye_height = random.uniform(1.5, 1.8), glance = random.uniform(0.1, 0.6);
    const Waver aside(random, 0.16), above(random, 0.2);
    return [=](double seconds) {
        const double metres = start_metres + pace * (seconds - start_seconds), steps = metres / 0.75 * pi;
        const V3d here = way(metres), ahead = way(metres + 1.5) - way(metres - 0.5);
        CameraPose pose = looking(here, here + ahead, fov);
        pose.position += V3d(0, eye_height + 0.025 * std::sin(2 * steps), 0);
        pose.yaw += glance * aside(seconds);
        pose.pitch = 0.5 * pose.pitch - 0.05 + 0.12 * above(seconds);
        pose.roll = 0.006 * std::sin(steps);
        return pose;
    };
}

Shot drive(Random& random, const Way& way, double start_metres, double start_seconds, double pace, double height) {
    const double fov = any_fov(random), tilt = random.uniform(-0.1, 0.02);
    const Waver bump(random, 4), glance(random, 0.2);
    return [=](double seconds) {
        const double metres = start_metres + pace * (seconds - start_seconds), look_ahead = 4 + 0.25 * std::abs(pace);
        const double way_ahead = std::copysign(look_ahead, pace);
        const V3d here = way(metres);
        CameraPose pose = looking(here, way(metres + way_ahead), fov);
        pose.position.y += height + 0.006 * bump(seconds);
        pose.yaw += 0.07 * glance(seconds);
        pose.pitch += tilt + 0.002 * bump(seconds + 7);
        return pose;
    };
}

Shot fly(Random& random, const Way& way, double start_metres, double start_seconds, double pace, double height) {
    const double fov = any_fov(random), tilt = random.uniform(-0.55, -0.12);
    const Waver heave(random, 0.12), glance(random, 0.1), bank(random, 0.15);
    return [=](double seconds) {
        const double metres = start_metres + pace * (seconds - start_seconds);
        const V3d here = way(metres);
        CameraPose pose = looking(here, way(metres + std::copysign(12, pace)), fov);
        pose.position.y += height * (1 + 0.2 * heave(seconds));
        pose.yaw += 0.3 * glance(seconds);
        pose.pitch = tilt + 0.1 * heave(seconds + 3);
        pose.roll = 0.12 * bank(seconds);
        return pose;
    };
}

Shot turn_fast(Random& random, const V3d& eye, double start_seconds) {
    const double fov = any_fov(random), pace = random.uniform(1, 3) * (random.below(2) ? 1 : -1);
    const double start = random.uniform(0, 2 * pi), swing = random.uniform(0.2, 1.2);
    const Waver speed(random, 0.5), above(random, 0.4);
    return [=](double seconds) {
        CameraPose pose;
        pose.position = eye;
        pose.fov_y = fov;
        pose.yaw = start + pace * (seconds - start_seconds) + swing * speed(seconds);
        pose.pitch = -0.04 + 0.15 * above(seconds);
        return pose;
    };
}

Shot orbit(Random& random, const Target& target, double radius, double height, double start_seconds) {
    const double fov = any_fov(random), start = random.uniform(0, 2 * pi);
    const double pace = random.uniform(0.2, 0.7) * (random.below(2) ? 1 : -1);
    const Waver heave(random, 0.2), away(random, 0.15);
    return [=](double seconds) {
        const V3d center = target(seconds);
        const double turn = start + pace * (seconds - start_seconds), far = radius * (1 + 0.15 * away(seconds));
        const V3d eye = center + V3d(far * std::cos(turn), height * (1 + 0.2 * heave(seconds)), far * std::sin(turn));
        return looking(eye, center, fov);
    };
}

Loop Loop::any(Random& random, const V2d& center, double radius) {
    Loop loop{.center = center, .radius = radius};
    loop.lobe2 = random.uniform(0, 0.25);
    loop.lobe3 = random.uniform(0, 0.18);
    loop.phase2 = random.uniform(0, 2 * pi);
    loop.phase3 = random.uniform(0, 2 * pi);
    return loop;
}

V2d Loop::place(double turn) const {
    const double r = radius * (1 + lobe2 * std::sin(2 * turn + phase2) + lobe3 * std::sin(3 * turn + phase3));
    return center + V2d(std::cos(turn), std::sin(turn)) * r;
}

bool Loop::passes(const V2d& spot, double thing_radius) const {
    constexpr int steps = 256;
    constexpr double free = 0.9;  // metres to either side
    for (int i = 0; i < steps; ++i) {
        if ((place(i * 2 * pi / steps) - spot).length() < thing_radius + free) return true;
    }
    return false;
}

Way along(const Loop& loop, const std::function<double(const V2d& at)>& height) {
    // Heights along the way, smoothed as legs and tyres do.
    constexpr int count = 256, smoothing = 4;
    std::array<double, count> heights{}, smooth{};
    for (int i = 0; i < count; ++i) heights[static_cast<size_t>(i)] = height(loop.place(2 * pi * i / count));
    for (int i = 0; i < count; ++i) {
        for (int j = -smoothing; j <= smoothing; ++j) {
            smooth[static_cast<size_t>(i)] +=
                heights[static_cast<size_t>((i + j + count) % count)] / (2 * smoothing + 1);
        }
    }
    return [=](double metres) {
        const double turn = metres / loop.radius, at = turn / (2 * pi) * count, floor = std::floor(at);
        const auto index = static_cast<size_t>(static_cast<long long>(floor) & (count - 1));
        const V2d here = loop.place(turn);
        return V3d(here.x, std::lerp(smooth[index], smooth[(index + 1) % count], at - floor), here.y);
    };
}

std::vector<ShotIdea> roaming_shots(const Scene& scene, const Stage& stage, const std::vector<Target>& targets) {
    const auto somewhere = [stage, &scene](Random& random, double low, double high) {
        return roam(scene, random, stage)(random.uniform(0, 1000)) + V3d(0, random.uniform(low, high), 0);
    };
    const auto pace = [](Random& random, double low, double high) {
        return random.uniform(low, high) * (random.below(2) ? 1 : -1);
    };
    const double size = std::min(1.0, stage.reach / 15);
    std::vector<ShotIdea> ideas = {
        [=, &scene](Random& random, double now) {
            const Way way = roam(scene, random, stage);
            return walk(random, way, random.uniform(0, 1000), now, random.uniform(1.2, 3.5) * size);
        },
        [=, &scene](Random& random, double now) {
            const Way way = roam(scene, random, stage);
            const double height = random.uniform(0.25, 1) * stage.top;
            return fly(random, way, random.uniform(0, 1000), now, pace(random, 4, 14) * size, height);
        },
        [=](Random& random, double now) { return turn_fast(random, somewhere(random, 1.3, 2), now); },
        [=](Random& random, double) {
            const V3d eye = somewhere(random, 0.8, 2.2), at = somewhere(random, 0.3, 2.5);
            const double fov = any_fov(random);
            return hand_held(
                random, [=](double) { return looking(eye, at, fov); }, random.uniform(0.7, 2.5));
        },
        [=, &scene](Random& random, double now) {
            const Way way = roam(scene, random, stage);
            return drive(random, way, random.uniform(0, 1000), now, pace(random, 5, 15) * size,
                         random.uniform(0.7, 1.5));
        },
        [=](Random& random, double now) {
            const V3d center = somewhere(random, 0.5, 2);
            return orbit(
                random, [=](double) { return center; }, random.uniform(0.15, 0.5) * stage.reach,
                random.uniform(0.05, 0.5) * stage.top, now);
        },
    };
    if (targets.empty()) return ideas;
    ideas.push_back([=](Random& random, double) {
        const Target target = targets[static_cast<size_t>(random.below(static_cast<int>(targets.size())))];
        return hand_held(random, follow(random, somewhere(random, 1, 2.5), target), 1);
    });
    return ideas;
}

}  // namespace clarus::render
