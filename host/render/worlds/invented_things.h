#pragma once

#include "render/worlds/invented_textures.h"
#include "render/worlds/props.h"

namespace clarus::render {

/// An invented world's materials: the demo's kinds, and more.
struct Materials : Palette {
    /// Adds them to the scene. At night more windows are lit.
    Materials(Scene& scene, Random& random, const ColorScheme& colors, bool night);

    /// With another sign, so that no two say the same.
    const Palette& with_any_sign(Random& random);
    int any_wall(Random& random) const {
        return walls[static_cast<size_t>(random.below(static_cast<int>(walls.size())))];
    }

    std::array<int, 8> walls{};  // solid surfaces of every kind
    std::array<int, 5> signs{};  // with writing
    std::array<int, 3> glows{};  // lamps, neon
    int window = 0, lit_window = 0, pane = 0, soil = 0, rock = 0;
    bool night = false;
};

// To stand on the ground at the origin, y up, in metres.
/// With rows of windows that stand in frames, some of them lit.
Model tower(const Materials& materials, Random& random, float width, float depth, int floors);
/// A building without walls but with floors, pillars, panes and things inside.
Model pavilion(Materials& materials, Random& random, float width, float depth, int floors);
Model boulder(const Materials& materials, Random& random, float radius);
Model conifer(const Materials& materials, Random& random);
/// Tanks, pipes and ladders.
Model works(const Materials& materials, Random& random);
/// Poles and boards around nothing.
Model scaffold(const Materials& materials, Random& random, float width, int floors);
/// A sign that glows, on a pole.
Model neon(Materials& materials, Random& random);

/// Balls, rings, boxes and rods in one; around the origin, within about `radius`.
Model sculpture(const Materials& materials, Random& random, float radius);

}  // namespace clarus::render
