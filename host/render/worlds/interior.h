#pragma once

#include <cstdint>

#include "render/worlds/world.h"

namespace clarus::render {

/// Rooms of a flat, with furniture of Debian's sweethome3d-furniture. `path` ≥ 0 chooses the camera's way. Errors: file
/// where the package is missing.
World make_interior_world(uint64_t seed, int path);

}  // namespace clarus::render
