#pragma once

#include "render/worlds/world.h"

namespace clarus::render {

/// Things that move and turn on their own, fast, before a wall full of patterns and behind fences and leaves, and that
/// stop: 36 frames in turn, of which in most films the last 12 stand still, in half of those with the camera. `seed`
/// chooses everything; seeds from first_reserved_action_seed choose from kinds of their own. `path` chooses the camera.
World make_action_world(uint64_t seed, int path);

}  // namespace clarus::render
