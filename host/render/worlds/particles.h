#pragma once

#include "render/random.h"
#include "render/scene.h"
#include "render/worlds/invented_textures.h"

namespace clarus::render {

// Blended cards that move, so that they have no motion vectors. Each has a material of its own.

/// Puffs that rise from a place, turn, and begin again below.
void add_smoke(Scene& scene, Random& random, const Imath::V3f& color, const Imath::V3d& from);
/// Glowing bits that a place throws up, and that fall.
void add_sparks(Scene& scene, Random& random, const Imath::V3f& color, const Imath::V3d& from);
/// Flakes, drops or dust in a box around a place; `fall` in metres a second.
void add_flurry(Scene& scene, Random& random, const Imath::V3f& color, const Imath::V3d& around, double reach,
                double fall);

}  // namespace clarus::render
