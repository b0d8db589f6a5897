#pragma once

#include <memory>

#include "render/scene.h"
#include "render/worlds/camera_path.h"

namespace clarus::render {

/// A small town's square, built and ready. `number` ≥ 0 is a seed: what stands and moves where, colours, the sun. Keeps
/// the camera's path free.
std::unique_ptr<Scene> make_demo_scene(int number, const CameraPath& path);

}  // namespace clarus::render
