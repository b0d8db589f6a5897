#pragma once

#include <span>

#include "render/random.h"
#include "render/scene.h"
#include "render/worlds/action_kinds.h"
#include "render/worlds/action_paint.h"

namespace clarus::render {

enum class ActionLight { day, dusk, night, dark_room, bright_room };
ActionLight any_action_light(Random& random);

/// Sun and sky, and what glows in them: at dusk the sun is seen, up to a radiance of 1000.
void light_action_set(Scene& scene, Random& random, ActionLight light);

/// What stands still: ground, a wall ten metres off that is hung with posters, things before it, two or three screens
/// to look through, lamps.
void build_action_set(Random& random, ActionPaint& paint, std::span<const ActionScreen> screens, ActionLight light,
                      Model& statics);

}  // namespace clarus::render
