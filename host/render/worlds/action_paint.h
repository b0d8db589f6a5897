#pragma once

#include <memory>
#include <span>

#include "render/random.h"
#include "render/scene.h"
#include "render/worlds/action_kinds.h"

namespace clarus::render {

/// A colour by its hue (0…1, red at 0), saturation and value, all in [0, 1]; linear.
Imath::V3f hue_color(float hue, float saturation, float value);

/// Two colours far apart, in either order: bright and dark, or two strong hues.
struct ColorPair {
    Imath::V3f ground, figure;
};
ColorPair contrasting_colors(Random& random);

/// A pattern in two colours.
std::shared_ptr<const Texture> action_texture(Random& random, ActionPattern pattern, const ColorPair& colors);

/// Makes the materials of one world, each in colours of its own.
class ActionPaint {
  public:
    /// `own_light`: a share of their light that patterned things give themselves, so that they stand out at night.
    ActionPaint(Scene& scene, Random& random, std::span<const ActionPattern> patterns, float own_light)
        : scene_(scene), random_(random), patterns_(patterns), own_light_(own_light) {}

    /// Saturated, of one colour.
    int plain() { return plain(strong_color()); }
    int plain(const Imath::V3f& color);
    /// Any of the world's patterns; `own_light` as for the world's moving things.
    int patterned(bool own_light = false);
    /// Patterned or plain, for large surfaces.
    int wall();
    /// Lamps and neon: the brightest channel's radiance is from 1.5 to 6, or from 40 to 1000.
    int glow();
    int leaves();
    /// Thin wires with holes between them: slanted as chain-link has them, or upright.
    int wire_net(bool slanted);

  private:
    Imath::V3f strong_color();
    int holed(std::shared_ptr<const Texture> texture);

    Scene& scene_;
    Random& random_;
    std::span<const ActionPattern> patterns_;
    float own_light_;
};

}  // namespace clarus::render
