#pragma once

#include "render/random.h"
#include "render/scene.h"

namespace clarus::render {

/// Sun and sky of any hour of the day, clear or hazy.
Environment daylight(Random& random);

}  // namespace clarus::render
