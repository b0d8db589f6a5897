#pragma once

#include "render/random.h"
#include "render/scene.h"
#include "render/worlds/action_kinds.h"
#include "render/worlds/action_paint.h"

namespace clarus::render {

/// Adds cloth that waves, about `distance` metres in front of the camera, as fast as the fast actors move. What holds
/// it goes into `statics`.
void add_action_cloth(Scene& scene, Random& random, ActionPaint& paint, ActionCloth kind, double distance,
                      Model& statics);

}  // namespace clarus::render
