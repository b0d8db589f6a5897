#pragma once

#include "render/random.h"
#include "render/scene.h"

namespace clarus::render {

/// A game's user interface: bars, words, numbers, a crosshair, a map, some of them.
Overlay invented_hud(Random& random);

}  // namespace clarus::render
