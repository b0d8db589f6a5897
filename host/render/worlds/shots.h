#pragma once

#include <functional>

#include "render/worlds/film.h"

namespace clarus::render {

/// A way along the ground, by its length in metres; it goes on for ever both ways.
using Way = std::function<Imath::V3d(double metres)>;
/// Where a thing is, by the time in seconds.
using Target = std::function<Imath::V3d(double seconds)>;

/// The pose that looks from one point to another.
CameraPose looking(const Imath::V3d& eye, const Imath::V3d& at, double fov_y);

/// A hand's tremble and sway on top of a shot; `strength` 1 is a person who stands and films.
Shot hand_held(Random& random, Shot shot, double strength);
/// From a fixed place at something that moves.
Shot follow(Random& random, const Imath::V3d& eye, const Target& target);
/// Ahead along a way, steps and glances aside included.
Shot walk(Random& random, const Way& way, double start_metres, double start_seconds, double metres_a_second);
/// Ahead along a way as from a car.
Shot drive(Random& random, const Way& way, double start_metres, double start_seconds, double metres_a_second,
           double height);
/// High above a way, looking down ahead.
Shot fly(Random& random, const Way& way, double start_metres, double start_seconds, double metres_a_second,
         double height);
/// From a fixed place, turning as fast as a player does, now and then holding still.
Shot turn_fast(Random& random, const Imath::V3d& eye, double start_seconds);
/// Around a point that may move.
Shot orbit(Random& random, const Target& target, double radius, double height, double start_seconds);

/// A closed winding line in the plane of x and z.
struct Loop {
    Imath::V2d center{0};
    double radius = 10, lobe2 = 0, lobe3 = 0, phase2 = 0, phase3 = 0;

    static Loop any(Random& random, const Imath::V2d& center, double radius);
    Imath::V2d place(double turn) const;
    /// Whether a thing of this radius would stand in the way of one who walks along.
    bool passes(const Imath::V2d& spot, double thing_radius) const;
};

/// Along a loop at the height that a place has.
Way along(const Loop& loop, const std::function<double(const Imath::V2d& at)>& height);

/// The part of a world in which cameras may be.
struct Stage {
    Imath::V2d center{0};     // x and z
    double reach = 10;        // metres from there
    double top = 20;          // of flights, above the ground
    double look_from = 60;    // where to look for the ground from; below every ceiling
    std::vector<Way> ways{};  // that are free; where there are none, any loop on the ground is tried
};
/// Every kind of shot there is. `targets`, which may be empty, are followed. The scene must be built, and outlive the
/// ideas.
std::vector<ShotIdea> roaming_shots(const Scene& scene, const Stage& stage, const std::vector<Target>& targets);

}  // namespace clarus::render
