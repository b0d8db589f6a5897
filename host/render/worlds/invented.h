#pragma once

#include <cstdint>

#include "render/worlds/world.h"

namespace clarus::render {

/// A world made up from a seed, and all of it: its look, its light, what stands, moves, flies and glows in it, what is
/// written on it and laid over it. `path` ≥ 0 chooses the camera's way.
World make_invented_world(uint64_t seed, int path);

}  // namespace clarus::render
