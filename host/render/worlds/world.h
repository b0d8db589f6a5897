#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "render/renderer.h"
#include "render/scene.h"

namespace clarus::render {

/// A scene, built and ready, and the camera's way through it.
struct World {
    std::unique_ptr<Scene> scene;
    std::function<FrameState(int frame)> frame;
};

/// By the name that `clarus render --scene` takes. `path` ≥ 0 chooses the camera's path, and in worlds that are made up
/// also what stands where. The same name and path give the same world. Errors: invalid_argument for an unknown name;
/// file where a file that it needs is missing or cannot be read, with the package that has it.
World make_world(const std::string& name, int path);

/// What make_world takes, for help texts.
struct WorldKind {
    std::string name;  // capital letters stand for something to fill in
    std::string description;
};
std::vector<WorldKind> world_kinds();

}  // namespace clarus::render
