#pragma once

#include "render/random.h"
#include "render/scene.h"

namespace clarus::render {

/// The demo scene's materials, as indices into the scene's.
struct Palette {
    /// Adds them to the scene; `random` chooses among colours.
    Palette(Scene& scene, Random& random);

    int tiles, slabs, cobbles, asphalt, lawn, field, brick, plaster, planks, concrete, bark, leaves, blades, lattice;
    int white_paint, rail, wire, chrome, gold, checker, sign, stripes, rubber, glass, lamp_glow, plates;
    std::array<int, 4> facades, roofs, paints, foliage;
};

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
