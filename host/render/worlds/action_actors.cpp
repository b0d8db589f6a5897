#include "render/worlds/action_actors.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>

#include "render/worlds/placement.h"
#include "render/worlds/props.h"

namespace clarus::render {
namespace {

using Imath::M44d;
using Imath::M44f;
using Imath::V2f;
using Imath::V3d;
using Imath::V3f;

constexpr double pi = std::numbers::pi;
constexpr double tan_half_width = 0.4649 * 16 / 9, tan_half_height = 0.4649;
constexpr float rod_cap = 1;

void add_rod(Mesh& mesh, const V3f& a, const V3f& b, float radius) {
    mesh.add_cylinder(a, b, radius, radius, 6, rod_cap);
}

/// In the xy plane, from its middle.
V3f spoke(int index, int count, float radius) {
    const float angle = 2 * static_cast<float>(pi) * static_cast<float>(index) / static_cast<float>(count);
    return V3f(std::cos(angle), std::sin(angle), 0) * radius;
}

/// Rings lie around the y axis; this stands them up in the xy plane.
M44f upright() { return turn(V3f(static_cast<float>(pi) / 2, 0, 0)); }

/// A board that faces both ways, with its middle at the origin.
void add_board(Mesh& mesh, float half_width, float half_height) {
    for (const float side : {1.0f, -1.0f}) {
        const float x = side * half_width, z = 0.01f * side;
        mesh.add_quad({V3f(-x, half_height, z), {x, half_height, z}, {x, -half_height, z}, {-x, -half_height, z}},
                      V2f(0), V2f(1));
    }
}

/// Makes one actor.
class Maker {
  public:
    Maker(Scene& scene, Random& random, ActionPaint& paint, double distance, Model& statics)
        : scene_(scene), random_(random), paint_(paint), distance_(distance), statics_(statics) {
        // Metres a second for so many pixels in a thirtieth.
        pace_ = std::exp(random_.uniform(std::log(5.0), std::log(25.0))) * distance_ / action_focal * 30;
        half_width_ = tan_half_width * distance_;
        half_height_ = 0.85 * tan_half_height * distance_;
        sign_ = random_.below(2) ? 1 : -1;
        phase_ = random_.uniform(0, 2 * pi);
    }

    void ball() {
        const float radius = size(0.05, 0.15);
        Mesh mesh{.material = random_.below(8) ? paint_.patterned(true) : paint_.glow()};
        mesh.add_sphere(V3f(0), radius, 24, static_cast<float>(1 + random_.below(3)));
        travel({mesh}, radius);
    }

    void box() {
        const float radius = size(0.06, 0.12);
        Mesh mesh{.material = paint_.patterned(true)};
        const V3f half = V3f(1, between(0.5, 1), between(0.5, 1)) * radius;
        mesh.add_box(-half, half, 2 * radius);
        travel({mesh}, radius);
    }

    /// Rolls along the ground, to and fro.
    void wheel() {
        const float radius = size(0.08, 0.16);
        Model model;
        const int spokes = 6 + random_.below(14);
        add_wheel(model, radius, spokes, random_.below(2) == 0);
        const double reach = random_.uniform(0.5, 1.1) * half_width_, rate = std::min(pace_, 6 * distance_) / reach;
        const double start = random_.uniform(-0.3, 0.3) * half_width_;
        const bool aloft = random_.below(2);
        const double height = aloft ? between_heights(radius) : radius, z = depth();
        scene_.add_moving(std::move(model), [=, phase = phase_](double seconds) {
            const double x = reach * std::sin(rate * seconds + phase);
            return placed(V3d(0, 0, -x / radius), V3d(start + x, height, z));
        });
    }

    void pendulum() {
        const float length = size(0.25, 0.5), radius = length * between(0.12, 0.25);
        Mesh rod{.material = paint_.plain()},
            bob{.material = random_.below(4) ? paint_.patterned(true) : paint_.glow()};
        add_rod(rod, V3f(0), {0, -length, 0}, 0.02f + 0.01f * radius);
        if (random_.below(2)) {
            bob.add_sphere({0, -length, 0}, radius, 20, 2);
        } else {
            bob.add_cylinder({0, -length, -0.1f * radius}, {0, -length, 0.1f * radius}, radius, radius, 24, radius);
        }
        const double swing = random_.uniform(0.5, 1.3), rate = pace_ / (length * swing);
        const V3d pivot(random_.uniform(-0.7, 0.7) * half_width_, action_eye.y + 0.6 * half_height_, depth());
        scene_.add_moving({rod, bob}, [=, phase = phase_](double seconds) {
            return placed(V3d(0, 0, swing * std::sin(rate * seconds + phase)), pivot);
        });
        mesh_of(statics_, rod.material)
            .add_cylinder(V3f(pivot), V3f(pivot) + V3f(0, 4, 0), 0.03f, 0.03f, 6, rod_cap, false);
    }

    /// Blades on a post, behind a guard of rings or without.
    void fan() {
        const float radius = size(0.12, 0.25);
        Mesh blades{.material = paint_.patterned(true)}, hub{.material = paint_.plain()};
        const int count = 3 + random_.below(4);
        for (int i = 0; i < count; ++i) {
            const V3f out = spoke(i, count, radius), side = V3f(-out.y, out.x, 0) * 0.3f, tilt(0, 0, 0.12f * radius);
            blades.add_quad({out * 0.15f, out + side * 0.2f, out + side + tilt, out * 0.3f + side + tilt}, V2f(0),
                            V2f(1));
        }
        hub.add_cylinder({0, 0, -0.2f * radius}, {0, 0, 0.15f * radius}, 0.12f * radius, 0.1f * radius, 12, rod_cap);
        const double rate = sign_ * std::min(pace_ / (0.7 * radius), 20.0);
        const V3d at(random_.uniform(-0.7, 0.7) * half_width_, between_heights(radius), depth());
        const V3d facing(random_.uniform(-0.3, 0.3), random_.uniform(-0.6, 0.6), 0);
        scene_.add_moving({blades, hub},
                          [=](double seconds) { return turn(V3d(0, 0, rate * seconds)) * placed(facing, at); });
        Mesh& iron = mesh_of(statics_, hub.material);
        const V3f behind = V3f(at) - V3f(0, 0, 0.25f * radius);
        iron.add_cylinder({behind.x, 0, behind.z}, behind, 0.05f, 0.03f, 8, rod_cap);
        if (random_.below(2)) return;
        Mesh guard;
        for (int ring = 1; ring <= 5; ++ring)
            guard.add_torus(V3f(0, 0.16f * radius, 0), 0.21f * radius * static_cast<float>(ring),
                            0.006f + 0.006f * radius, 32, 5, V2f(1));
        iron.append(guard, upright() * M44f(placed(facing, at)));
    }

    /// Print on a stick, carried past.
    void label() {
        const float width = size(0.12, 0.25), height = width * between(0.4, 0.8);
        Mesh board{.material = paint_.patterned(true)}, stick{.material = paint_.plain()};
        add_board(board, width, height);
        add_rod(stick, {0, -height, 0}, {0, -height - width, 0}, 0.02f);
        const double reach = random_.uniform(0.4, 0.9) * half_width_, rate = pace_ / reach;
        const double level = between_heights(height), tilt = random_.uniform(0, 0.4), z = depth();
        const double bob = random_.uniform(0, 0.06) * distance_;
        scene_.add_moving({board, stick}, [=, phase = phase_](double seconds) {
            const double turned = rate * seconds + phase;
            return placed(V3d(0, tilt * std::cos(1.3 * turned), tilt * std::sin(2.1 * turned)),
                          V3d(reach * std::sin(turned), level + bob * std::sin(4 * turned), z));
        });
    }

    /// Walks or runs across close to the camera, all but the head and the ground in view.
    void passer_by() {
        const int shirt = paint_.patterned(true), trousers = paint_.plain(), skin = paint_.plain();
        Model body;
        mesh_of(body, shirt).add_cylinder({0, 0.85f, 0}, {0, 1.45f, 0}, 0.17f, 0.2f, 12, 0.6f);
        mesh_of(body, skin).add_sphere({0, 1.65f, 0}, 0.13f, 16, 1);
        mesh_of(body, trousers).add_cylinder({0, 1.72f, 0}, {0, 1.82f, 0}, 0.15f, 0.12f, 14, rod_cap);
        Model leg, arm;
        mesh_of(leg, trousers).add_cylinder(V3f(0), {0, -0.85f, 0}, 0.1f, 0.06f, 8, rod_cap);
        mesh_of(arm, shirt).add_cylinder(V3f(0), {0, -0.6f, 0}, 0.07f, 0.05f, 8, 0.6f);
        const double reach = random_.uniform(0.8, 1.5) * half_width_, rate = std::min(pace_, 4.0) / reach;
        const double z = depth(), step = random_.uniform(5, 9);
        const auto walk = [=, phase = phase_](double seconds) {
            return placed(V3d(0), V3d(reach * std::sin(rate * seconds + phase), 0, z));
        };
        scene_.add_moving(std::move(body), walk);
        for (const double side : {-1.0, 1.0}) {
            const auto limb = [&](Model model, const V3d& joint, double swing) {
                scene_.add_moving(std::move(model), [=](double seconds) {
                    return placed(V3d(0, 0, swing * std::sin(step * seconds)), joint) * walk(seconds);
                });
            };
            limb(leg, V3d(0, 0.86, 0.09 * side), 0.6 * side);
            limb(arm, V3d(0, 1.4, 0.24 * side), -0.5 * side);
        }
    }

    /// Wires between two fixed points that swing like a skipping rope.
    void wire() {
        const double span = random_.uniform(0.8, 1.6) * half_width_, middle = random_.uniform(-0.4, 0.4) * half_width_;
        const double height = action_eye.y + random_.uniform(0.1, 0.6) * half_height_, z = depth();
        const float sag = size(0.06, 0.2);
        const int material = paint_.plain();
        for (int i = 1 + random_.below(4); i > 0; --i) {
            Mesh mesh{.material = material};
            const auto half = static_cast<float>(span / 2);
            add_wire(mesh, {-half, 0, 0}, {half, 0, 0}, sag, between(0.004, 0.02));
            const double swing = random_.uniform(0.4, 1.4), rate = std::min(pace_ / (sag * swing), 12.0);
            const V3d at(middle, height + 0.12 * i, z);
            scene_.add_moving({mesh}, [=, phase = phase_ + i](double seconds) {
                return placed(V3d(swing * std::sin(rate * seconds + phase), 0, 0), at);
            });
        }
        for (const double end : {-0.5, 0.5}) {
            const V3f foot(V3d(middle + end * span, 0, z));
            mesh_of(statics_, material)
                .add_cylinder(foot, foot + V3f(0, static_cast<float>(height) + 0.6f, 0), 0.04f, 0.03f, 8, rod_cap);
        }
    }

    void gear() {
        const float radius = size(0.09, 0.18);
        Mesh disc{.material = paint_.patterned(true)}, teeth{.material = paint_.plain()};
        disc.add_cylinder({0, 0, -0.1f * radius}, {0, 0, 0.1f * radius}, 0.8f * radius, 0.8f * radius, 32, radius);
        const int count = 8 + random_.below(12);
        const float half = 1.2f * radius / static_cast<float>(count);
        for (int i = 0; i < count; ++i) {
            const float angle = 2 * static_cast<float>(pi) * static_cast<float>(i) / static_cast<float>(count);
            teeth.add_box({0.75f * radius, -half, -0.1f * radius}, {radius, half, 0.1f * radius}, 1,
                          turn(V3f(0, 0, angle)));
        }
        travel({disc, teeth}, radius);
    }

    void cage() {
        const float radius = size(0.08, 0.16);
        Mesh bars{.material = paint_.plain()}, ring;
        Mesh core{.material = random_.below(4) ? paint_.patterned(true) : paint_.glow()};
        ring.add_torus(V3f(0), radius, 0.03f * radius, 32, 6, V2f(1));
        const int count = 4 + random_.below(5);
        for (int i = 0; i < count; ++i)
            bars.append(ring, upright() * turn(V3f(0, static_cast<float>(pi * i / count), 0)));
        bars.append(ring);
        core.add_sphere(V3f(0), 0.45f * radius, 16, 2);
        travel({bars, core}, radius);
    }

    void star() {
        const float radius = size(0.08, 0.16);
        Mesh core{.material = paint_.patterned(true)}, spikes{.material = paint_.plain()};
        core.add_sphere(V3f(0), 0.35f * radius, 16, 2);
        const int count = 9 + random_.below(10);
        for (int i = 0; i < count; ++i) {  // evenly over the sphere
            const float y = 1 - 2 * (static_cast<float>(i) + 0.5f) / static_cast<float>(count);
            const float angle = 2.39996f * static_cast<float>(i), ring = std::sqrt(1 - y * y);
            const V3f out(ring * std::cos(angle), y, ring * std::sin(angle));
            spikes.add_cylinder(out * (0.3f * radius), out * radius, 0.12f * radius, 0.01f * radius, 6, rod_cap, false);
        }
        travel({core, spikes}, radius);
    }

    void ladder() {
        const float half = size(0.12, 0.22), width = 0.3f * half;
        Mesh wood{.material = paint_.patterned(true)};
        for (const float x : {-width, width})
            wood.add_box({x - 0.04f * half, -half, -0.04f * half}, {x + 0.04f * half, half, 0.04f * half}, half);
        const int rungs = 6 + random_.below(8);
        for (int i = 0; i < rungs; ++i) {
            const float y = half * (2 * (static_cast<float>(i) + 0.5f) / static_cast<float>(rungs) - 1);
            add_rod(wood, {-width, y, 0}, {width, y, 0}, 0.025f * half);
        }
        travel({wood}, half);
    }

  private:
    float between(double low, double high) { return static_cast<float>(random_.uniform(low, high)); }
    /// In shares of how far away it is, so that near and far things look as large.
    float size(double low, double high) { return 1.25f * between(low, high) * static_cast<float>(distance_); }
    double depth() const { return action_eye.z - distance_; }
    double between_heights(double radius) {
        const double low = std::max(radius + 0.05, action_eye.y - half_height_ + radius);
        return random_.uniform(low, std::max(low, action_eye.y + half_height_ - radius));
    }

    void add_wheel(Model& model, float radius, int spokes, bool crossed) {
        Mesh& rim = mesh_of(model, paint_.patterned(true));
        Mesh ring;
        ring.add_torus(V3f(0), 0.94f * radius, 0.06f * radius, 40, 8, {16, 1});
        rim.append(ring, upright());
        Mesh& iron = mesh_of(model, paint_.plain());
        for (int i = 0; i < spokes; ++i) {
            const V3f hub = spoke(crossed ? i + 2 : i, spokes, 0.12f * radius);
            add_rod(iron, hub, spoke(i, spokes, 0.92f * radius), 0.004f + 0.012f * radius);
        }
        iron.add_cylinder({0, 0, -0.1f * radius}, {0, 0, 0.1f * radius}, 0.14f * radius, 0.14f * radius, 12, rod_cap);
    }

    /// Through the air or hopping, and turning.
    void travel(Model model, double radius) {
        const V3d tilt(random_.uniform(-pi, pi), random_.uniform(-pi, pi), random_.uniform(-pi, pi));
        const double spin = sign_ * std::min(random_.uniform(0, 1.2) * pace_ / radius, 15.0);
        const double reach = random_.uniform(0.35, 0.85) * half_width_, rate = pace_ / reach;
        const double level = between_heights(radius), start = random_.uniform(-0.3, 0.3) * half_width_;
        const double rise = random_.uniform(0.1, 0.6) * half_height_, z = depth();
        const double least = radius, ratio = std::array{1.0, 1.5, 2.0, 3.0}[static_cast<size_t>(random_.below(4))];
        const bool hops = random_.below(3) == 0;
        scene_.add_moving(std::move(model), [=, phase = phase_](double seconds) {
            const double turned = rate * seconds + phase;
            const double wave = hops ? std::abs(std::sin(ratio * turned)) : std::sin(ratio * turned + 1);
            const V3d at(start + reach * std::sin(turned), std::max(least, level + rise * wave), z);
            return turn(V3d(0, spin * seconds, 0)) * placed(tilt, at);
        });
    }

    Scene& scene_;
    Random& random_;
    ActionPaint& paint_;
    double distance_;
    Model& statics_;
    double pace_, half_width_, half_height_, sign_, phase_;
};

}  // namespace

void add_action_actor(Scene& scene, Random& random, ActionPaint& paint, ActionActor kind, double distance,
                      Model& statics) {
    Maker maker(scene, random, paint, distance, statics);
    switch (kind) {
        case ActionActor::ball:
            return maker.ball();
        case ActionActor::box:
            return maker.box();
        case ActionActor::wheel:
            return maker.wheel();
        case ActionActor::pendulum:
            return maker.pendulum();
        case ActionActor::fan:
            return maker.fan();
        case ActionActor::label:
            return maker.label();
        case ActionActor::passer_by:
            return maker.passer_by();
        case ActionActor::wire:
            return maker.wire();
        case ActionActor::gear:
            return maker.gear();
        case ActionActor::cage:
            return maker.cage();
        case ActionActor::star:
            return maker.star();
        case ActionActor::ladder:
            return maker.ladder();
    }
}

}  // namespace clarus::render
