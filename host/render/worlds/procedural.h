#pragma once

#include <memory>
#include <string_view>

#include "render/texture.h"

namespace clarus::render {

/// A texture drawn by a formula; the same call gives the same texels. Errors: invalid_argument for an unknown name.
/// Opaque: tiles cobbles asphalt grass brick plaster planks shingles plates checker sign facade clouds stripes concrete
/// bark. With holes: leaves lattice blades.
std::shared_ptr<const Texture> procedural_texture(std::string_view name);

}  // namespace clarus::render
