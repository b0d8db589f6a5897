#include "render/worlds/demo_scene.h"

#include <array>
#include <cmath>
#include <numbers>

#include "render/worlds/placement.h"
#include "render/worlds/procedural.h"
#include "render/worlds/props.h"

namespace clarus::render {
namespace {

using Imath::M44d;
using Imath::M44f;
using Imath::V2d;
using Imath::V2f;
using Imath::V3d;
using Imath::V3f;

constexpr double pi = std::numbers::pi;

// Half the sides of the squares that bound the ground's kinds, from the middle outwards.
constexpr float plaza_side = 20, lawn_side = 27, road_side = 34, pavement_side = 38, horizon_side = 1500;

/// A point of a square track with round corners, and where it heads; `along` in metres.
M44d on_track(double along, double half_side, double corner) {
    const double straight = 2 * (half_side - corner), arc = corner * pi / 2, side = straight + arc;
    along = std::fmod(along, 4 * side);
    if (along < 0) along += 4 * side;
    const int quarter = static_cast<int>(along / side);
    const double rest = along - quarter * side;
    V3d place(rest - straight / 2, 0, half_side);
    double heading = 0;
    if (rest > straight) {
        heading = (rest - straight) / corner;
        place = V3d(straight / 2 + corner * std::sin(heading), 0, half_side - corner + corner * std::cos(heading));
    }
    return turn(V3d(0, heading, 0)) * move(place) * turn(V3d(0, quarter * pi / 2, 0));
}

class Town {
  public:
    Town(Scene& scene, int number, const CameraPath& path)
        : scene_(scene),
          path_(path),
          random_(static_cast<uint64_t>(number) * 2),
          palette_(demo_palette(scene, random_)),
          paving_(static_cast<size_t>(number % 4)) {}

    void build() {
        set_environment();
        lay_ground();
        raise_houses();
        furnish_lawn();
        furnish_plaza();
        add_traffic();
        scene_.add_static(ground_and_things_);
    }

  private:
    float between(double low, double high) { return static_cast<float>(random_.uniform(low, high)); }
    double angle() { return random_.uniform(0, 2 * pi); }

    void put(const Model& model, V3f at, double heading = 0) {
        append(ground_and_things_, model, turn(V3f(0, static_cast<float>(heading), 0)) * move(at));
    }

    /// A free place on the plaza for a thing of this radius, then taken. False where none was found.
    bool find_place(double radius, V3f& place) {
        for (int attempt = 0; attempt < 60; ++attempt) {
            const V2d spot(random_.uniform(-19, 19), random_.uniform(-19, 19));
            if (path_.passes(spot, radius)) continue;
            bool taken = false;
            for (const auto& [center, other_radius] : taken_) taken |= (center - spot).length() < radius + other_radius;
            if (taken) continue;
            taken_.push_back({spot, radius});
            place = V3f(static_cast<float>(spot.x), 0, static_cast<float>(spot.y));
            return true;
        }
        return false;
    }

    void set_environment() {
        Environment& environment = scene_.environment;
        const double azimuth = angle(), elevation = random_.uniform(0.45, 1.1);
        environment.to_sun = V3f(
            V3d(std::cos(azimuth) * std::cos(elevation), std::sin(elevation), std::sin(azimuth) * std::cos(elevation)));
        const float warmth = static_cast<float>(1.1 - elevation);
        environment.sun = V3f(2.3f, 2.15f - 0.3f * warmth, 1.95f - 0.8f * warmth);
        environment.zenith = V3f(0.16f, 0.33f, 0.72f) * between(0.75, 1.15);
        environment.horizon = V3f(0.62f, 0.70f, 0.80f) + V3f(0.15f, 0.02f, -0.1f) * warmth;
        environment.ground = V3f(0.10f, 0.09f, 0.08f);
        environment.clouds = procedural_texture("clouds");
        environment.haze = between(0.0008, 0.0025);
    }

    /// The ground between two squares around the origin, in pieces so that texture coordinates keep their precision.
    void lay_ring(int material, float inner, float outer, float repeat, float height = 0) {
        Mesh& mesh = mesh_of(ground_and_things_, material);
        const auto lay = [&](float left, float top, float right, float bottom) {
            const int columns = static_cast<int>(std::ceil((right - left) / 60)),
                      rows = static_cast<int>(std::ceil((bottom - top) / 60));
            for (int row = 0; row < rows; ++row) {
                for (int column = 0; column < columns; ++column) {
                    const auto x = [&](int i) {
                        return std::lerp(left, right, static_cast<float>(i) / static_cast<float>(columns));
                    };
                    const auto z = [&](int i) {
                        return std::lerp(top, bottom, static_cast<float>(i) / static_cast<float>(rows));
                    };
                    const float x0 = x(column), x1 = x(column + 1), z0 = z(row), z1 = z(row + 1);
                    mesh.add_quad({V3f(x0, height, z1), {x1, height, z1}, {x1, height, z0}, {x0, height, z0}},
                                  V2f(x0, z1) / repeat, V2f(x1, z0) / repeat);
                }
            }
        };
        lay(-outer, -outer, outer, -inner);
        lay(-outer, inner, outer, outer);
        lay(-outer, -inner, -inner, inner);
        lay(inner, -inner, outer, inner);
    }

    void lay_ground() {
        const std::array pavings = {palette_.cobbles, palette_.tiles, palette_.brick, palette_.slabs};
        const std::array repeats = {2.2f, 2.0f, 1.3f, 1.5f};
        lay_ring(pavings[paving_], 0, plaza_side - 1.5f, repeats[paving_]);
        lay_ring(palette_.cobbles, plaza_side - 1.5f, plaza_side, 1.6f);
        lay_ring(palette_.lawn, plaza_side, lawn_side, 3);
        lay_ring(palette_.asphalt, lawn_side, road_side, 4);
        lay_ring(palette_.concrete, road_side, pavement_side, 2.4f);
        lay_ring(palette_.field, pavement_side, horizon_side, 7);
        Mesh& paint = mesh_of(ground_and_things_, palette_.white_paint);
        const float middle = (lawn_side + road_side) / 2;
        for (int quarter = 0; quarter < 4; ++quarter) {
            const M44f place = turn(V3f(0, static_cast<float>(quarter * pi / 2), 0));
            for (float x = -24; x < 24; x += 3)
                paint.add_box({x, 0, middle - 0.07f}, {x + 1.5f, 0.006f, middle + 0.07f}, 1, place);
            // A zebra crossing.
            for (float z = lawn_side + 0.4f; z < road_side - 0.4f; z += 1) {
                paint.add_box({-2, 0, z}, {2, 0.006f, z + 0.5f}, 1, place);
            }
            mesh_of(ground_and_things_, palette_.concrete)
                .add_box({-lawn_side, 0, lawn_side - 0.2f}, {lawn_side, 0.12f, lawn_side}, 2.4f, place);
        }
    }

    void raise_houses() {
        for (int quarter = 0; quarter < 4; ++quarter) {
            const M44f place = turn(V3f(0, static_cast<float>(quarter * pi / 2), 0));
            // Two rows behind the pavement, facing the square from −z.
            for (float x = -44; x < 40;) {
                const float width = between(8, 14), depth = between(8, 11),
                            gap = random_.below(3) == 0 ? between(2, 7) : 0;
                append(ground_and_things_, house(palette_, random_, width, depth, between(6, 15)),
                       move(V3f(x + width / 2, 0, -pavement_side - 0.5f - depth / 2)) * place);
                x += width + gap;
            }
            for (int tower = 0; tower < 5; ++tower) {
                append(ground_and_things_, house(palette_, random_, between(12, 20), between(12, 20), between(18, 42)),
                       move(V3f(between(-130, 130), 0, between(-190, -75))) * place);
            }
            for (int grown = 0; grown < 14; ++grown) {
                append(ground_and_things_, tree(palette_, random_),
                       move(V3f(between(-140, 140), 0, between(-150, -62))) * place);
            }
        }
        // A power line across everything.
        const double direction = angle();
        const V3f along(static_cast<float>(std::cos(direction)), 0, static_cast<float>(std::sin(direction)));
        const V3f aside(along.z * 55, 0, -along.x * 55);
        Mesh wires{.material = palette_.wire};
        for (int post = -4; post <= 4; ++post) {
            const V3f foot = aside + along * (45.0f * static_cast<float>(post));
            const float turned = static_cast<float>(pi / 2 - direction);
            put(pylon(palette_, 24), foot, turned);
            for (const float arm : {-2.0f, 0.0f, 2.0f}) {
                const V3f at = foot + V3f(0, 21.6f, 0) + V3f(-along.z, 0, along.x) * arm;
                if (post < 4) add_wire(wires, at, at + along * 45.0f, 1.8f, 0.02f);
            }
        }
        append(ground_and_things_, {wires});
    }

    void furnish_lawn() {
        for (int quarter = 0; quarter < 4; ++quarter) {
            const M44f place = turn(V3f(0, static_cast<float>(quarter * pi / 2), 0));
            const auto on_lawn = [&] { return move(V3f(between(-26, 26), 0, between(-26, -20.8))) * place; };
            for (int i = 0; i < 5; ++i) append(ground_and_things_, tree(palette_, random_), on_lawn());
            for (int i = 0; i < 8; ++i) append(ground_and_things_, bush(palette_, random_), on_lawn());
            for (int i = 0; i < 130; ++i) append(ground_and_things_, grass_tuft(palette_, random_), on_lawn());
            const bool netted = random_.below(2) == 0;
            for (const float x : {-19.0f, 3.0f}) {
                append(ground_and_things_, netted ? wire_fence(palette_, 16) : railing(palette_, 16),
                       move(V3f(x, 0, -20.2f)) * place);
            }
            for (int i = 0; i < 3; ++i) {
                append(ground_and_things_, sign_board(palette_, 2.6f, 1.5f),
                       turn(V3f(0, between(-0.4, 0.4), 0)) * move(V3f(between(-24, 24), 0, -35.5f)) * place);
            }
            for (float x = -30; x <= 30; x += 12)
                append(ground_and_things_, lamp(palette_),
                       turn(V3f(0, static_cast<float>(-pi / 2), 0)) * move(V3f(x, 0, -34.6f)) * place);
        }
    }

    void furnish_plaza() {
        V3f at;
        // Spinning things first, since they are what is hardest to get right.
        if (find_place(2.2, at)) {
            const float height = between(4.5, 6);
            Mesh mast{.material = palette_.planks};
            mast.add_cylinder(V3f(0), {0, height, 0}, 0.5f, 0.22f, 10, 1);
            put({mast}, at);
            spin(rotor(palette_, 2.1f), V3d(at) + V3d(0, height - 0.3, 0), V3d(0, angle(), 0), V3d(0, 0, 1), 2.2,
                 V3d(0, 0, 0.75));
        }
        for (int i = 0; i < 3; ++i) {
            if (find_place(1.4, at)) {
                Mesh pedestal{.material = palette_.concrete};
                pedestal.add_box({-0.7f, 0, -0.7f}, {0.7f, 1, 0.7f}, 1.3f);
                put({pedestal}, at, angle());
                spin(ring_sculpture(palette_, 0.95f), V3d(at) + V3d(0, 2.1, 0), V3d(angle(), angle(), 0),
                     V3d(0.3, 1, 0.2), random_.uniform(0.8, 2));
            }
        }
        if (find_place(1.3, at))
            spin(rod_drum(palette_, 0.9f, 1.7f), V3d(at) + V3d(0, 0.1, 0), V3d(0), V3d(0, 1, 0),
                 random_.uniform(0.6, 1.6));
        for (int i = 0; i < 3; ++i) {
            if (!find_place(1.4, at)) continue;
            Mesh axle{.material = palette_.rail};
            axle.add_cylinder(V3f(0), {0, 1.5f, 0}, 0.06f, 0.05f, 8, 1);
            put({axle}, at);
            spin(spoked_wheel(palette_, 1.2f), V3d(at) + V3d(0, 1.5, 0), V3d(0, angle(), 0), V3d(0, 0, 1),
                 random_.uniform(-3, 3), V3d(0, 0, 0.12));
        }
        for (int i = 0; i < 5; ++i) {
            if (!find_place(1.0, at)) continue;
            Mesh cube{.material = i == 1 ? palette_.checker : palette_.sign};
            cube.add_box(V3f(-0.55f), V3f(0.55f), 1.1f);
            spin({cube}, V3d(at) + V3d(0, 1.3, 0), V3d(0.6, 0, 0.6), V3d(random_.uniform(-1, 1), 1, 0.3),
                 random_.uniform(0.7, 2.2));
        }
        for (int i = 0; i < 6; ++i) {
            if (find_place(0.8, at)) bounce(V3d(at));
        }
        std::vector<V3f> lamps;
        for (int i = 0; i < 6; ++i) {
            if (!find_place(0.5, at)) continue;
            put(lamp(palette_), at, angle());
            lamps.push_back(at + V3f(0, 4.2f, 0));
        }
        Mesh wires{.material = palette_.wire};
        for (size_t i = 1; i < lamps.size(); ++i) add_wire(wires, lamps[i - 1], lamps[i], 0.5f, 0.008f);
        append(ground_and_things_, {wires});
        for (int i = 0; i < 4; ++i) {
            if (find_place(1.8, at)) put(stall(palette_, random_), at, angle());
        }
        for (int i = 0; i < 7; ++i) {
            if (find_place(1.6, at)) plant_tree(at);
        }
        for (int i = 0; i < 5; ++i) {
            if (find_place(1.3, at)) put(sign_board(palette_, 2, 1.2f), at, angle());
            if (find_place(1.6, at)) railing_piece(at);
        }
        for (int i = 0; i < 11; ++i) {
            if (find_place(0.6, at)) put(column(palette_, random_), at, angle());
            if (find_place(0.9, at)) put(bench(palette_), at, angle());
            if (find_place(1.0, at)) put(crates(palette_, random_), at, angle());
            if (find_place(0.4, at)) put(barrel(palette_, random_), at);
            if (find_place(0.8, at)) put(bush(palette_, random_), at);
        }
    }

    void plant_tree(V3f at) {
        Mesh box{.material = palette_.brick};
        box.add_box({-0.8f, 0, -0.8f}, {0.8f, 0.5f, 0.8f}, 1.6f);
        put({box}, at);
        put(tree(palette_, random_), at, angle());
        for (int i = 0; i < 10; ++i)
            put(grass_tuft(palette_, random_), at + V3f(between(-0.7, 0.7), 0.5f, between(-0.7, 0.7)));
    }

    void railing_piece(V3f at) {
        const double heading = angle();
        const V3f half(1.5f * static_cast<float>(std::cos(heading)), 0, -1.5f * static_cast<float>(std::sin(heading)));
        put(railing(palette_, 3), at - half, heading);
    }

    /// Turns around `axis` of its own space, displaced there by `offset`, then tilted and put at `center`.
    void spin(Model model, V3d center, V3d tilt, V3d axis, double radians_a_second, V3d offset = V3d(0)) {
        const M44d fixed = move(offset) * turn(tilt) * move(center);
        const double start = angle();
        scene_.add_moving(std::move(model), [=](double seconds) {
            M44d spinning;
            spinning.setAxisAngle(axis.normalized(), start + radians_a_second * seconds);
            return spinning * fixed;
        });
    }

    void bounce(V3d foot) {
        Mesh ball{.material = palette_.checker};
        const double radius = random_.uniform(0.2, 0.4), height = random_.uniform(0.6, 1.6),
                     pace = random_.uniform(0.5, 1);
        ball.add_sphere(V3f(0), static_cast<float>(radius), 28, 2);
        const double start = random_.uniform(), turning = random_.uniform(-4, 4);
        scene_.add_moving({ball}, [=](double seconds) {
            const double t = start + seconds * pace, phase = t - std::floor(t);
            const V3d at = foot + V3d(0, radius + 4 * height * phase * (1 - phase), 0);
            return turn(V3d(0, turning * seconds, 0.3)) * move(at);
        });
    }

    void add_traffic() {
        for (int i = 0; i < 8; ++i) {
            const bool inner = i % 2;
            const double lane = inner ? 28.8 : 32.2, speed = random_.uniform(6, 12) * (inner ? 1 : -1),
                         start = i * 30.0 + random_.uniform(0, 12);
            scene_.add_moving(car(palette_, random_), [=](double seconds) {
                return turn(V3d(0, inner ? 0 : pi, 0)) * on_track(start + speed * seconds, lane, 6);
            });
        }
        // Drones: a ring with a rotor, circling above the plaza.
        for (int i = 0; i < 3; ++i) {
            Mesh body{.material = palette_.paints[static_cast<size_t>(i)]}, rods{.material = palette_.rail};
            body.add_sphere(V3f(0), 0.18f, 16, 1);
            for (int arm = 0; arm < 4; ++arm) {
                const float a = static_cast<float>(arm * pi / 2);
                const V3f out(std::cos(a), 0.1f, std::sin(a));
                rods.add_cylinder(V3f(0), out * 0.5f, 0.015f, 0.01f, 4, 1);
                rods.add_torus(out * 0.5f, 0.2f, 0.01f, 20, 4, {4, 1});
            }
            const double radius = random_.uniform(3, 15), height = random_.uniform(3.2, 6),
                         pace = random_.uniform(-0.5, 0.5), start = angle();
            scene_.add_moving({body, rods}, [=](double seconds) {
                const double a = start + pace * seconds;
                return turn(V3d(0.2, -3 * a, 0)) *
                       move(V3d(radius * std::cos(a), height + 0.3 * std::sin(3 * a), radius * std::sin(a)));
            });
        }
    }

    Scene& scene_;
    const CameraPath& path_;
    Random random_;
    Palette palette_;
    size_t paving_;
    Model ground_and_things_;
    std::vector<std::pair<V2d, double>> taken_;
};

}  // namespace

std::unique_ptr<Scene> make_demo_scene(int number, const CameraPath& path) {
    auto scene = std::make_unique<Scene>();
    Town(*scene, number, path).build();
    scene->build();
    return scene;
}

}  // namespace clarus::render
