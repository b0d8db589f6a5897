#pragma once

#include <Imath/ImathVec.h>

#include "render/random.h"
#include "render/scene.h"
#include "render/worlds/action_kinds.h"
#include "render/worlds/action_paint.h"

namespace clarus::render {

// The cameras of these worlds stand about here, look along −z, and see about this much.
constexpr Imath::V3d action_eye{0, 1.7, 5};
constexpr double action_fov_y = 0.87;
/// Pixels that a metre at a distance of a metre has in a picture of 144 rows.
constexpr double action_focal = 72 / 0.4649;

/// Adds something that moves on its own, about `distance` metres in front of the camera: fast ones by 5 to 25 pixels of
/// a picture of 144 rows in a thirtieth of a second. What of it stands still goes into `statics`.
void add_action_actor(Scene& scene, Random& random, ActionPaint& paint, ActionActor kind, double distance,
                      Model& statics);

}  // namespace clarus::render
