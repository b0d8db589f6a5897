#pragma once

#include <filesystem>

#include "render/worlds/world.h"

namespace clarus::render {

/// A model file, standing on a plain. One that is less than 2 m long, or more than 2 km, is taken to be in other units
/// than metres and made 20 m long. Errors: file.
World make_model_world(const std::filesystem::path& file, int path);

}  // namespace clarus::render
