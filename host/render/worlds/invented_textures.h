#pragma once

#include <memory>
#include <vector>

#include "render/random.h"
#include "render/texture.h"

namespace clarus::render {

/// Colours that a world's things have, linear; the same few come back everywhere.
class ColorScheme {
  public:
    explicit ColorScheme(Random& random);
    /// `brightness` is about the colour's mean.
    Imath::V3f pick(Random& random, float brightness) const;

  private:
    std::vector<Imath::V3f> hues_;  // of mean 1
};

/// A pattern for a solid surface: stones, boards, weaves, dirt, and mixtures; its detail's size is random, too.
std::shared_ptr<const Texture> invented_surface(Random& random, const ColorScheme& colors, float brightness);
/// Leaves, with holes between them.
std::shared_ptr<const Texture> invented_leaves(Random& random, const Imath::V3f& color);
/// Wires that cross, with holes between them.
std::shared_ptr<const Texture> invented_mesh(Random& random, const Imath::V3f& color);
/// A round spot that fades to nothing, more or less ragged: smoke, glows, dust.
std::shared_ptr<const Texture> invented_puff(Random& random, const Imath::V3f& color);

}  // namespace clarus::render
