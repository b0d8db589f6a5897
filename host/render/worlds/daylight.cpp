#include "render/worlds/daylight.h"

#include <cmath>
#include <numbers>

#include "render/worlds/procedural.h"

namespace clarus::render {

using Imath::V3d;
using Imath::V3f;

Environment daylight(Random& random) {
    const auto between = [&](double low, double high) { return static_cast<float>(random.uniform(low, high)); };
    const double azimuth = random.uniform(0, 2 * std::numbers::pi), elevation = random.uniform(0.12, 1.3);
    // Low suns are red and weak; overcast skies take the sun's share over.
    const float warmth = static_cast<float>(std::exp(-3 * elevation));
    const float overcast = random.below(4) == 0 ? between(0.5, 0.95) : between(0, 0.3);
    Environment environment;
    environment.to_sun =
        V3f(V3d(std::cos(azimuth) * std::cos(elevation), std::sin(elevation), std::sin(azimuth) * std::cos(elevation)));
    environment.sun = V3f(2.4f, 2.25f - 0.8f * warmth, 2.05f - 1.5f * warmth) * (1 - 0.85f * overcast);
    const V3f grey(0.62f, 0.64f, 0.68f);
    const V3f blue = V3f(0.16f, 0.33f, 0.72f) * between(0.7, 1.2);
    environment.zenith = blue + (grey * 0.8f - blue) * overcast;
    environment.horizon =
        V3f(0.62f, 0.70f, 0.80f) * (1 - 0.35f * warmth) + V3f(0.45f, 0.08f, -0.25f) * (warmth * (1 - overcast));
    environment.ground = V3f(0.11f, 0.10f, 0.09f);
    environment.clouds = procedural_texture("clouds");
    environment.haze = between(0.0003, 0.0012) + (random.below(5) == 0 ? between(0.001, 0.006) : 0);
    return environment;
}

}  // namespace clarus::render
