#include "render/worlds/action_set.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "render/worlds/action_actors.h"
#include "render/worlds/daylight.h"
#include "render/worlds/noise.h"
#include "render/worlds/placement.h"
#include "render/worlds/props.h"

namespace clarus::render {
namespace {

using Imath::M44f;
using Imath::V2f;
using Imath::V3d;
using Imath::V3f;

constexpr float pi = std::numbers::pi_v<float>;
constexpr float wall_z = -5, half_wall = 26, room_front = 9;

bool indoors(ActionLight light) { return light == ActionLight::dark_room || light == ActionLight::bright_room; }

std::shared_ptr<const Texture> no_clouds() {
    return std::make_shared<Texture>(0, [](float, float) { return Rgba{0, 0, 0, 1}; });
}

class Builder {
  public:
    Builder(Random& random, ActionPaint& paint, ActionLight light, Model& statics)
        : random_(random), paint_(paint), light_(light), statics_(statics) {}

    void ground() {
        Mesh& mesh = mesh_of(statics_, paint_.wall());
        const float repeat = between(1, 3.5);
        constexpr float side = 1.3f;  // small, so that shade shows under things
        for (float x = -half_wall; x < half_wall; x += side) {
            for (float z = wall_z; z < room_front; z += side) {
                mesh.add_quad({V3f(x, 0, z + side), {x + side, 0, z + side}, {x + side, 0, z}, {x, 0, z}},
                              V2f(x, z + side) / repeat, V2f(x + side, z) / repeat);
            }
        }
        if (indoors(light_)) return;
        mesh_of(statics_, paint_.plain(V3f(0.12f, 0.11f, 0.1f)))
            .add_quad({V3f(-200, -0.02f, 100), {200, -0.02f, 100}, {200, -0.02f, -200}, {-200, -0.02f, -200}}, V2f(0),
                      V2f(1));
    }

    void wall() {
        const float height = indoors(light_) ? between(3.6, 6) : between(2.2, 8);
        const std::array faces = {paint_.wall(), paint_.wall(), paint_.wall()};
        const float repeat = between(0.8, 3);
        const int bays = 1 + random_.below(4);
        constexpr float piece = 2;
        for (float x = -half_wall; x < half_wall; x += piece) {
            const int bay = static_cast<int>((x + half_wall) / piece) / bays % 3;
            Mesh& mesh = mesh_of(statics_, faces[static_cast<size_t>(bay)]);
            for (float y = 0; y < height; y += 1.5f) {
                const float top = std::min(y + 1.5f, height);
                mesh.add_quad({V3f(x, top, wall_z), {x + piece, top, wall_z}, {x + piece, y, wall_z}, {x, y, wall_z}},
                              V2f(x, -top) / repeat, V2f(x + piece, -y) / repeat);
            }
        }
        mesh_of(statics_, faces[1])
            .add_box({-half_wall, height - 0.05f, wall_z - 0.5f}, {half_wall, height, wall_z - 0.01f}, repeat);
        posters(height);
        if (indoors(light_)) room(height, repeat, faces[2]);
        if (!indoors(light_)) towers();
    }

    /// Things of many sizes before the wall.
    void things() {
        for (int i = 3 + random_.below(5); i > 0; --i) {
            const float x = between(-5, 5), z = between(wall_z + 0.8, wall_z + 3), width = between(0.2, 0.7);
            const float high = between(0.4, 2.6);
            Mesh& mesh = mesh_of(statics_, paint_.wall());
            if (random_.below(2)) {
                mesh.add_box({-width, 0, -width}, {width, high, width}, 2 * width,
                             placed(V3f(0, between(0, 3), 0), V3f(x, 0, z)));
            } else {
                mesh.add_cylinder({x, 0, z}, {x, high, z}, width, width * between(0.3, 1), 24, 1);
            }
        }
    }

    void screen(ActionScreen kind) {
        // Before the actors, among them, or behind; now and then only beside.
        const float z = static_cast<float>(action_eye.z) - std::array{2.2f, 4.5f, 8.8f}[index(3)];
        const float left = random_.below(2) ? -8.0f : between(-2, 0.5),
                    right = left + (left < -7 ? 16 : between(1.5, 4));
        switch (kind) {
            case ActionScreen::chain_link:
                return net(left, right, z, true);
            case ActionScreen::netting:
                return net(left, right, z, false);
            case ActionScreen::louvres:
                return louvres(z);
            case ActionScreen::foliage:
                return foliage(z);
            case ActionScreen::wires:
                return wires(z);
            case ActionScreen::beads:
                return beads(left, right, z);
            case ActionScreen::trellis:
                return trellis(left, right, z);
        }
    }

    void lamps() {
        const bool dark = light_ == ActionLight::night || light_ == ActionLight::dark_room;
        for (int i = dark ? 6 + random_.below(5) : 1 + random_.below(3); i > 0; --i) {
            const float x = between(-5.5, 5.5), y = between(0.8, 3.6), z = wall_z + between(0.15, 0.6);
            Mesh& mesh = mesh_of(statics_, paint_.glow());
            switch (random_.below(4)) {
                case 0:
                    mesh.add_sphere({x, y, z}, between(0.05, 0.25), 16, 1);
                    break;
                case 1: {  // a tube
                    const float half = between(0.3, 1.2);
                    const V3f along = random_.below(2) ? V3f(half, 0, 0) : V3f(0, half, 0);
                    mesh.add_cylinder(V3f(x, y, z) - along, V3f(x, y, z) + along, 0.04f, 0.04f, 8, 1);
                    break;
                }
                case 2: {  // a ring
                    Mesh ring;
                    ring.add_torus(V3f(0), between(0.2, 0.6), 0.035f, 32, 6, V2f(1));
                    mesh.append(ring, placed(V3f(pi / 2, 0, 0), V3f(x, y, z)));
                    break;
                }
                default: {  // a line that goes to and fro
                    V3f last(x, y, z);
                    const float width = between(0.1, 0.3);
                    for (int k = 0; k < 6; ++k) {
                        const V3f next = last + V3f(width, k % 2 ? -0.4f : 0.4f, 0);
                        mesh.add_cylinder(last, next, 0.03f, 0.03f, 6, 1);
                        last = next;
                    }
                }
            }
        }
    }

  private:
    float between(double low, double high) { return static_cast<float>(random_.uniform(low, high)); }
    size_t index(int count) { return static_cast<size_t>(random_.below(count)); }

    void posters(float wall_height) {
        for (int i = 10 + random_.below(8); i > 0; --i) {
            const float x = between(-7, 7), half = between(0.25, 1), high = half * between(0.5, 1.3);
            const float y = between(high + 0.1, std::max(high + 0.2f, wall_height - high));
            const float z = wall_z + 0.02f + 0.004f * static_cast<float>(i);
            mesh_of(statics_, paint_.patterned(true))
                .add_quad({V3f(x - half, y + high, z),
                           {x + half, y + high, z},
                           {x + half, y - high, z},
                           {x - half, y - high, z}},
                          V2f(0), V2f(1));
        }
    }

    void room(float height, float repeat, int side_wall) {
        Mesh& sides = mesh_of(statics_, side_wall);
        const float x = between(6, 10);
        for (const float side : {-1.0f, 1.0f}) {
            for (float z = wall_z; z < room_front; z += 2) {
                for (float y = 0; y < height; y += height / 3)
                    sides.add_box({side * x - 0.1f, y, z}, {side * x + 0.1f, y + height / 3, z + 2}, repeat);
            }
        }
        const int ceiling = paint_.wall();
        const bool lit = light_ == ActionLight::bright_room;
        for (float z = wall_z; z < room_front; z += 2) {
            for (float at = -x; at < x; at += 2)
                mesh_of(statics_, ceiling).add_box({at, height, z}, {at + 2, height + 0.1f, z + 2}, 2);
            if (lit || random_.below(3) == 0) {
                Mesh& tube = mesh_of(statics_, paint_.glow());
                const float at = between(-0.6, 0.6) * x;
                tube.add_box({at - 0.6f, height - 0.08f, z + 0.9f}, {at + 0.6f, height - 0.02f, z + 1.1f}, 1);
            }
        }
    }

    /// What stands behind the wall, against the sky.
    void towers() {
        for (int i = 6 + random_.below(8); i > 0; --i) {
            const float x = between(-40, 40), z = between(-60, -14), half = between(1.5, 4), high = between(3, 18);
            mesh_of(statics_, paint_.patterned())
                .add_box({x - half, 0, z - half}, {x + half, high, z + half}, between(2, 5));
        }
    }

    void net(float left, float right, float z, bool slanted) {
        const float height = between(1.6, 3.4), scale = between(0.8, 2);
        mesh_of(statics_, paint_.wire_net(slanted))
            .add_quad({V3f(left, height, z), {right, height, z}, {right, 0, z}, {left, 0, z}}, V2f(0),
                      V2f(right - left, height) * scale);
        Mesh& posts = mesh_of(statics_, paint_.plain());
        for (float x = left; x <= right + 0.01f; x += (right - left) / std::ceil((right - left) / 2.5f))
            posts.add_cylinder({x, 0, z}, {x, height + 0.1f, z}, 0.03f, 0.03f, 8, 1);
        posts.add_cylinder({left, height, z}, {right, height, z}, 0.02f, 0.02f, 8, 1);
    }

    void louvres(float z) {
        const float width = between(0.8, 2.2), left = between(-3.5, 2), pitch = between(0.05, 0.16);
        const float low = between(0, 0.8), high = low + between(1.2, 2.5), tilt = between(0.3, 1.1);
        Mesh& mesh = mesh_of(statics_, paint_.plain());
        for (float y = low; y < high; y += pitch) {
            mesh.add_box({-width / 2, -0.006f, -0.45f * pitch}, {width / 2, 0.006f, 0.45f * pitch}, 1,
                         placed(V3f(tilt, 0, 0), V3f(left + width / 2, y, z)));
        }
        for (const float x : {left, left + width})
            mesh.add_box({x - 0.03f, low - 0.05f, z - 0.06f}, {x + 0.03f, high + 0.05f, z + 0.06f}, 1);
    }

    /// Cards with leaves in heaps; near the camera at the picture's edges.
    void foliage(float z) {
        const std::array kinds = {paint_.leaves(), paint_.leaves()};
        for (int heap = 3 + random_.below(4); heap > 0; --heap) {
            const float side = random_.below(2) ? 1.0f : -1.0f, away = static_cast<float>(action_eye.z) - z;
            const V3f middle(side * between(0.35, 1) * away, random_.below(3) ? between(0.2, 1.2) : between(2.2, 3.4),
                             z);
            Mesh& mesh = mesh_of(statics_, kinds[index(2)]);
            for (int card = 0; card < 14; ++card) {
                const float size = between(0.15, 0.4);
                const V3f angles(between(-0.8, 0.8), between(-pi, pi), between(-0.8, 0.8));
                const V3f at = middle + V3f(between(-0.5, 0.5), between(-0.4, 0.4), between(-0.4, 0.4));
                Mesh one;
                one.add_quad({V3f(-size, size, 0), {size, size, 0}, {size, -size, 0}, {-size, -size, 0}}, V2f(0),
                             V2f(1));
                mesh.append(one, placed(angles, at));
            }
        }
    }

    void wires(float z) {
        Mesh& mesh = mesh_of(statics_, paint_.plain());
        for (int i = 4 + random_.below(6); i > 0; --i) {
            const float left_height = between(1, 4), right_height = between(1, 4), at = z + between(-0.6, 0.6);
            add_wire(mesh, {-7, left_height, at}, {7, right_height, at}, between(0.1, 0.8), between(0.004, 0.016));
        }
    }

    /// Strings of beads, as curtains in doors have them.
    void beads(float left, float right, float z) {
        const std::array kinds = {paint_.plain(), paint_.plain(), paint_.plain()};
        right = std::min(right, left + 5);
        const float radius = between(0.02, 0.04), gap = between(0.12, 0.3);
        for (float x = left; x < right; x += gap) {
            mesh_of(statics_, kinds[0]).add_cylinder({x, 0.3f, z}, {x, 3.2f, z}, 0.004f, 0.004f, 4, 1, false);
            for (float y = 3.1f; y > 0.4f; y -= 3.2f * radius)
                mesh_of(statics_, kinds[index(3)]).add_sphere({x, y, z}, radius, 8, 1);
        }
    }

    /// Crossed laths.
    void trellis(float left, float right, float z) {
        Mesh& mesh = mesh_of(statics_, paint_.plain());
        const float gap = between(0.15, 0.4), half = between(0.008, 0.02), height = between(1.6, 2.8);
        const M44f slant = turn(V3f(0, 0, between(-0.5, 0.5)));
        right = std::min(right, left + 6);
        const V3f middle((left + right) / 2, height / 2, z);
        const float across = (right - left) / 2, up = height / 2;
        for (float x = -across; x <= across; x += gap)
            mesh.add_box({x - half, -up, -0.01f}, {x + half, up, 0.01f}, 1, slant * move(middle));
        for (float y = -up; y <= up; y += gap)
            mesh.add_box({-across, y - half, 0.01f}, {across, y + half, 0.03f}, 1, slant * move(middle));
    }

    Random& random_;
    ActionPaint& paint_;
    ActionLight light_;
    Model& statics_;
};

}  // namespace

ActionLight any_action_light(Random& random) {
    using enum ActionLight;
    constexpr std::array lights = {day, day, day, day, dusk, dusk, night, night, dark_room, dark_room, bright_room};
    return lights[static_cast<size_t>(random.below(static_cast<int>(lights.size())))];
}

void light_action_set(Scene& scene, Random& random, ActionLight light) {
    const auto between = [&](double low, double high) { return static_cast<float>(random.uniform(low, high)); };
    Environment& environment = scene.environment;
    environment = daylight(random);
    environment.haze = between(0, 0.0015);
    const V3f tint = hue_color(between(0, 1), between(0.1, 0.5), 1);
    // Before the wall, so that shadows fall on it; at dusk above it.
    const float azimuth = between(-1.1, 1.1),
                elevation = light == ActionLight::dusk ? between(0.16, 0.35) : between(0.4, 1.2);
    const float ahead = light == ActionLight::dusk ? -1.0f : 1.0f, aside = light == ActionLight::dusk ? 0.4f : 1.0f;
    environment.to_sun = V3f(std::sin(aside * azimuth) * std::cos(elevation), std::sin(elevation),
                             ahead * std::cos(aside * azimuth) * std::cos(elevation));
    switch (light) {
        case ActionLight::day:
            environment.sun = V3f(2.5f, 2.3f, 2.0f) * between(0.7, 1.2);
            break;
        case ActionLight::dusk: {
            environment.sun = V3f(2.6f, 1.2f, 0.4f);
            environment.horizon = V3f(1.1f, 0.45f, 0.25f) * between(0.6, 1.3);
            environment.zenith = V3f(0.8f, 0.65f, 0.75f);
            // Blended, so that it shades nothing and has the sky's depth and motion.
            Mesh sun{.material =
                         scene.add_material({.texture = std::make_shared<Texture>(0,
                                                                                  [](float, float) {
                                                                                      return Rgba{1, 0.72f, 0.4f, 1};
                                                                                  }),
                                             .emission = between(100, 1000),
                                             .blended = true})};
            sun.add_sphere(environment.to_sun * 160, between(1.5, 4), 32, 1);
            scene.add_static({sun});
            break;
        }
        case ActionLight::night:
            environment.sun = V3f(0.1f, 0.12f, 0.2f);
            environment.zenith = tint * between(0.25, 1);
            environment.horizon = tint * between(0.04, 0.2);
            environment.ground = tint * between(0.1, 0.4);
            environment.clouds = no_clouds();
            break;
        case ActionLight::dark_room:
            environment.sun *= 0.8f;
            environment.zenith = tint * between(0.7, 2.5);
            environment.horizon = tint * 0.2f;
            environment.ground = tint * between(0.2, 0.7);
            break;
        case ActionLight::bright_room:
            environment.sun = V3f(1.6f);
            environment.zenith = environment.horizon = V3f(2.4f, 2.4f, 2.3f) * between(0.8, 1.2);
            environment.ground = V3f(0.9f);
            break;
    }
}

void build_action_set(Random& random, ActionPaint& paint, std::span<const ActionScreen> screens, ActionLight light,
                      Model& statics) {
    Builder builder(random, paint, light, statics);
    builder.ground();
    builder.wall();
    builder.things();
    for (int i = 2 + random.below(2); i > 0; --i)
        builder.screen(screens[static_cast<size_t>(random.below(static_cast<int>(screens.size())))]);
    builder.lamps();
}

}  // namespace clarus::render
