#pragma once

#include <memory>
#include <string>
#include <vector>

#include "render/worlds/shots.h"
#include "render/worlds/world.h"

namespace clarus::render {

/// A scene with everything added, which is built here, and cameras that roam it as roaming_shots has them. `name` and
/// `path` choose the film.
World roaming_world(std::unique_ptr<Scene> scene, const std::string& name, int path, const Stage& stage,
                    const std::vector<Target>& targets);

}  // namespace clarus::render
