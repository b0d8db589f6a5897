#pragma once

#include "render/random.h"
#include "render/scene.h"

namespace clarus::render {

/// What things are made of: materials, as indices into the scene's.
struct Palette {
    int tiles = 0, slabs = 0, cobbles = 0, asphalt = 0, lawn = 0, field = 0, brick = 0, plaster = 0, planks = 0,
        concrete = 0, bark = 0, leaves = 0, blades = 0, lattice = 0;
    int white_paint = 0, rail = 0, wire = 0, chrome = 0, gold = 0, checker = 0, sign = 0, stripes = 0, rubber = 0,
        glass = 0, lamp_glow = 0, plates = 0;
    std::array<int, 4> facades{}, roofs{}, paints{}, foliage{};
};

/// The demo scene's, added to the scene; `random` chooses among colours.
Palette demo_palette(Scene& scene, Random& random);

// Things to stand on the ground at the origin, y up, in metres. What looks different each time takes `random`.
Model tree(const Palette& palette, Random& random);
Model bush(const Palette& palette, Random& random);
Model grass_tuft(const Palette& palette, Random& random);
Model bench(const Palette& palette);
Model lamp(const Palette& palette);
Model crates(const Palette& palette, Random& random);
Model barrel(const Palette& palette, Random& random);
Model column(const Palette& palette, Random& random);
Model railing(const Palette& palette, float length);     // along x from the origin
Model wire_fence(const Palette& palette, float length);  // along x from the origin
Model sign_board(const Palette& palette, float width, float height);
Model stall(const Palette& palette, Random& random);
Model house(const Palette& palette, Random& random, float width, float depth, float height);
Model pylon(const Palette& palette, float height);

// Moving things, around the origin.
Model car(const Palette& palette, Random& random);                   // drives towards +x
Model rotor(const Palette& palette, float radius);                   // in the xy plane, turns around z
Model rod_drum(const Palette& palette, float radius, float height);  // turns around y
Model ring_sculpture(const Palette& palette, float radius);
Model spoked_wheel(const Palette& palette, float radius);  // in the xy plane, turns around z

/// A sagging wire between two points.
void add_wire(Mesh& mesh, Imath::V3f from, Imath::V3f to, float sag, float radius);

}  // namespace clarus::render
