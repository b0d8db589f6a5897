#pragma once

#include <embree3/rtcore.h>

#include <vector>

#include "render/mesh.h"

namespace clarus::render {

/// Ambient occlusion, baked: for every vertex of every mesh the share of the sky's light, 0…1, that nearby surfaces of
/// `solid` let through on the side of the vertex's normal. `solid`: a committed scene in the meshes' space. The
/// directions looked into are always the same, so there is no noise; how many depends on `all_vertices`, those of
/// the whole scene, so that large scenes too are baked in seconds.
std::vector<std::vector<float>> bake_openness(RTCScene solid, const Model& model, size_t all_vertices);

}  // namespace clarus::render
