#pragma once

#include <string>

#include "render/worlds/world.h"

namespace clarus::render {

/// A race track of Debian's torcs-data, which cars drive on. `path` chooses the cars, the light and the camera.
/// Errors: invalid_argument for an unknown track; file where torcs-data is missing or broken.
World make_torcs_world(const std::string& track, int path);

/// The tracks that are installed, in the alphabet's order; none where torcs-data is missing.
std::vector<std::string> torcs_tracks();

}  // namespace clarus::render
