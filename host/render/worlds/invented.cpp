#include "render/worlds/invented.h"

#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>

#include "render/worlds/daylight.h"
#include "render/worlds/hud.h"
#include "render/worlds/invented_things.h"
#include "render/worlds/noise.h"
#include "render/worlds/particles.h"
#include "render/worlds/placement.h"
#include "render/worlds/roaming_world.h"
#include "render/worlds/seed.h"

namespace clarus::render {
namespace {

using Imath::M44d;
using Imath::M44f;
using Imath::V2d;
using Imath::V2f;
using Imath::V3d;
using Imath::V3f;

constexpr double pi = std::numbers::pi;
constexpr double reach = 26;  // of the part that is walked through, from the origin

enum class Theme { town, woods, desert, works, city_at_night, hall };
constexpr int themes = 6;

Environment night(Random& random) {
    Environment environment = daylight(random);
    const auto level = static_cast<float>(random.uniform(0.12, 0.35));
    environment.sun = V3f(0.20f, 0.24f, 0.33f) * static_cast<float>(random.uniform(1, 3));  // the moon
    environment.zenith = V3f(0.25f, 0.35f, 0.7f) * level;
    environment.horizon = V3f(0.9f, 0.75f, 0.7f) * level;
    environment.ground = V3f(0.6f, 0.5f, 0.4f) * level;
    environment.clouds = std::make_shared<Texture>(0, [](float, float) { return Rgba{0, 0, 0, 1}; });
    return environment;
}

class Inventor {
  public:
    Inventor(Scene& scene, uint64_t seed)
        : scene_(scene),
          random_(seed_of("procedural", seed)),
          theme_(static_cast<Theme>(seed % themes)),
          colors_(random_),
          night_(theme_ == Theme::city_at_night || (theme_ != Theme::woods && random_.below(6) == 0)),
          materials_(scene, random_, colors_, night_) {
        for (const double radius : {0.25, 0.5, 0.78}) {
            loops_.push_back(Loop::any(random_, {0, 0}, radius * reach / 1.2));
        }
    }

    Stage invent() {
        scene_.environment = night_ ? night(random_) : daylight(random_);
        salt_ = random_.below(1 << 20);
        switch (theme_) {
            case Theme::town:
                hills_ = 0;
                break;
            case Theme::woods:
                hills_ = random_.uniform(1.5, 6);
                break;
            case Theme::desert:
                hills_ = random_.uniform(1, 4);
                break;
            default:
                hills_ = 0;
        }
        lay_ground();
        const double density = random_.uniform(0.6, 1.5);
        const auto some = [&](double count) { return static_cast<int>(std::lround(count * density)); };
        switch (theme_) {
            case Theme::town:
                town(some);
                break;
            case Theme::woods:
                woods(some);
                break;
            case Theme::desert:
                desert(some);
                break;
            case Theme::works:
                industry(some);
                break;
            case Theme::city_at_night:
                city(some);
                break;
            case Theme::hall:
                hall(some);
                break;
        }
        moving_things(some(14));
        particles();
        if (random_.below(3) == 0) scene_.overlay = invented_hud(random_);
        scene_.add_static(statics_);
        const bool indoors = theme_ == Theme::hall;
        std::vector<Way> ways;
        for (const Loop& loop : loops_) ways.push_back(along(loop, [this](const V2d& at) { return ground(at); }));
        return {.center = {0, 0},
                .reach = indoors ? 0.55 * reach : reach,
                .top = indoors ? 3.5 : random_.uniform(6, 16),
                .look_from = indoors ? 4.0 : 80.0,
                .ways = ways};
    }

    const std::vector<Target>& targets() const { return targets_; }

  private:
    float between(double low, double high) { return static_cast<float>(random_.uniform(low, high)); }
    double angle() { return random_.uniform(0, 2 * pi); }

    /// Hills that leave the middle of walked ways smooth enough.
    double ground(const V2d& at) const {
        if (hills_ == 0) return 0;
        const auto u = static_cast<float>(at.x / 240 + 0.5), v = static_cast<float>(at.y / 240 + 0.5);
        return hills_ * (4 * noise(u, v, 7, 7, salt_) + noise(u, v, 26, 26, salt_ + 1) - 2.5) / 2;
    }

    void put(const Model& model, const V2d& at, double heading, double height = 0) {
        append(statics_, model, M44f(placed(V3d(0, heading, 0), {at.x, ground(at) + height, at.y})));
    }

    /// A free place within `far` of the origin and outside `near`, then taken.
    std::optional<V2d> find_place(double radius, double near, double far) {
        for (int attempt = 0; attempt < 40; ++attempt) {
            const double turn = angle(), distance = std::sqrt(random_.uniform(near * near, far * far));
            V2d spot = V2d(std::cos(turn), std::sin(turn)) * distance;
            if (attempt % 3 && radius < 2) {  // beside a way, where it is seen
                const double aside = random_.uniform(0.9 + radius, 5) * (random_.below(2) ? 1 : -1);
                const Loop& loop = loops_[static_cast<size_t>(random_.below(static_cast<int>(loops_.size())))];
                spot = loop.place(turn) * (1 + aside / loop.radius);
            }
            bool taken = false;
            for (const Loop& loop : loops_) taken = taken || loop.passes(spot, radius);
            for (const auto& [center, other] : taken_) taken = taken || (center - spot).length() < radius + other;
            if (taken) continue;
            taken_.push_back({spot, radius});
            return spot;
        }
        return std::nullopt;
    }

    /// As many of a thing as find room.
    template <typename Make>
    void scatter(int count, double radius, double near, double far, const Make& make) {
        for (int i = 0; i < count; ++i) {
            if (const auto spot = find_place(radius, near, far)) put(make(), *spot, angle());
        }
    }

    void lay_ground() {
        std::array<int, 3> kinds = {materials_.slabs, materials_.tiles, materials_.asphalt};
        if (theme_ == Theme::woods) kinds = {materials_.lawn, materials_.field, materials_.soil};
        if (theme_ == Theme::desert) kinds = {materials_.soil, materials_.soil, materials_.rock};
        const std::array repeats = {between(1, 5), between(1, 3), between(2, 5)};
        // Small facets on hills; on the flat ones as large as shading needs.
        const double fine = hills_ > 0 ? 1.5 : 3;
        const auto steps = static_cast<int>(120 / fine);
        const auto vertex = [&](Mesh& mesh, const V2d& at, float repeat) {
            const auto height = [&](double dx, double dz) { return ground(at + V2d(dx, dz)); };
            const V3d normal(height(-0.5, 0) - height(0.5, 0), 1, height(0, -0.5) - height(0, 0.5));
            mesh.positions.push_back(V3f(V3d(at.x, ground(at), at.y)));
            mesh.normals.push_back(V3f(normal.normalized()));
            mesh.uvs.push_back(V2f(at) / repeat);
            return static_cast<uint32_t>(mesh.positions.size() - 1);
        };
        for (int row = -steps; row < steps; ++row) {
            for (int column = -steps; column < steps; ++column) {
                const V2d at(column * fine, row * fine);
                const auto u = static_cast<float>(at.x / 240 + 0.5), v = static_cast<float>(at.y / 240 + 0.5);
                const float patch = noise(u, v, 32, 32, salt_ + 2);
                const size_t kind = patch < 0.5f ? 0 : patch < 0.68f ? 1 : 2;
                Mesh& mesh = mesh_of(statics_, kinds[kind]);
                const uint32_t a = vertex(mesh, at, repeats[kind]), b = vertex(mesh, at + V2d(fine, 0), repeats[kind]),
                               c = vertex(mesh, at + V2d(fine, fine), repeats[kind]),
                               d = vertex(mesh, at + V2d(0, fine), repeats[kind]);
                mesh.triangles.push_back({a, b, c});
                mesh.triangles.push_back({a, c, d});
            }
        }
        // On to the horizon, a little lower.
        Mesh& far = mesh_of(statics_, materials_.field);
        const float low = static_cast<float>(-2.5 * hills_) - 0.05f;
        for (float x = -10; x < 10; ++x) {
            for (float z = -10; z < 10; ++z) {
                const V3f a(x * 80, low, z * 80), b((x + 1) * 80, low, (z + 1) * 80);
                far.add_quad({V3f(a.x, low, b.z), b, {b.x, low, a.z}, a}, V2f(0), V2f(80 / 6.0f));
            }
        }
    }

    void greenery(int trees, double near) {
        const bool needles = random_.below(2);
        scatter(trees, 0.9, near, reach + 8,
                [&] { return needles && random_.below(3) ? conifer(materials_, random_) : tree(materials_, random_); });
        scatter(trees, 0.6, near, reach, [&] { return bush(materials_, random_); });
        scatter(6 * trees, 0.15, 2, reach, [&] { return grass_tuft(materials_, random_); });
    }

    void street_things(int count) {
        scatter(count, 1, 3, reach,
                [&] { return sign_board(materials_.with_any_sign(random_), between(1.2, 3.5), between(0.8, 1.8)); });
        scatter(count, 0.5, 3, reach, [&] { return lamp(materials_); });
        scatter(count, 0.9, 3, reach, [&] { return bench(materials_); });
        scatter(count, 1, 3, reach, [&] { return crates(materials_, random_); });
        scatter(count, 0.4, 3, reach, [&] { return barrel(materials_, random_); });
        scatter(count, 1.6, 3, reach, [&] {
            Model fence = random_.below(2) ? wire_fence(materials_, 3) : railing(materials_, 3);
            Model centered;
            append(centered, fence, move(V3f(-1.5f, 0, 0)));
            return centered;
        });
    }

    /// Poles in a row across everything, and what hangs between them.
    void cables(int lines) {
        for (int line = 0; line < lines; ++line) {
            const double heading = angle(), aside = random_.uniform(-0.8, 0.8) * reach, height = random_.uniform(4, 9);
            const V2d along(std::cos(heading), std::sin(heading)), offset = V2d(-along.y, along.x) * aside;
            const double spacing = random_.uniform(9, 20);
            Mesh wires{.material = materials_.wire}, poles{.material = materials_.planks};
            const auto top = [&](int i, double arm) {
                const V2d at = offset + along * (i * spacing) + V2d(-along.y, along.x) * arm;
                return V3f(V3d(at.x, ground(offset + along * (i * spacing)) + height, at.y));
            };
            for (int pole = -3; pole <= 3; ++pole) {
                const V3f up = top(pole, 0);
                const V2d foot(up.x, up.z);
                bool free = true;
                for (const Loop& loop : loops_) free = free && !loop.passes(foot, 0.2);
                if (free)
                    poles.add_cylinder(up - V3f(0, static_cast<float>(height) + 1, 0), up + V3f(0, 0.4f, 0), 0.12f,
                                       0.08f, 8, 1);
                for (const double arm : {-0.8, -0.3, 0.4}) {
                    if (pole < 3)
                        add_wire(wires, top(pole, arm), top(pole + 1, arm), between(0.3, 1.2), between(0.008, 0.025));
                }
            }
            append(statics_, {wires, poles});
        }
    }

    void town(const auto& some) {
        scatter(some(26), 7, 9, 55, [&] {
            return random_.below(4)
                       ? tower(materials_, random_, between(7, 11), between(7, 11), 1 + random_.below(5))
                       : pavilion(materials_, random_, between(7, 10), between(6, 9), 1 + random_.below(3));
        });
        scatter(some(3), 2, 4, reach, [&] { return stall(materials_, random_); });
        street_things(some(13));
        greenery(some(16), 3);
        cables(1 + random_.below(3));
    }

    void woods(const auto& some) {
        scatter(some(150), 0.9, 2, 75,
                [&] { return random_.below(2) ? conifer(materials_, random_) : tree(materials_, random_); });
        scatter(some(30), 1.2, 3, reach, [&] { return boulder(materials_, random_, between(0.3, 1.3)); });
        scatter(some(700), 0.1, 1, reach, [&] { return grass_tuft(materials_, random_); });
        scatter(some(60), 0.6, 2, reach, [&] { return bush(materials_, random_); });
        scatter(1 + random_.below(3), 5, 8, reach, [&] { return pavilion(materials_, random_, 6, 6, 1); });
        scatter(some(8), 1.6, 3, reach, [&] { return wire_fence(materials_, 2.5f); });
        cables(random_.below(2));
    }

    void desert(const auto& some) {
        scatter(some(70), 1.9, 4, 70, [&] { return boulder(materials_, random_, between(0.4, 3)); });
        scatter(some(120), 0.5, 2, reach, [&] { return boulder(materials_, random_, between(0.1, 0.4)); });
        scatter(some(30), 0.6, 3, reach, [&] { return column(materials_, random_); });
        scatter(some(10), 5, 7, 45,
                [&] { return pavilion(materials_, random_, between(5, 8), between(5, 8), 1 + random_.below(2)); });
        scatter(some(160), 0.2, 2, reach, [&] { return grass_tuft(materials_, random_); });
        scatter(some(8), 3.5, 8, reach,
                [&] { return scaffold(materials_, random_, between(2, 6), 1 + random_.below(3)); });
        cables(1 + random_.below(3));
    }

    void industry(const auto& some) {
        scatter(some(18), 4.5, 5, 50, [&] { return works(materials_, random_); });
        scatter(some(12), 6.5, 9, 50,
                [&] { return tower(materials_, random_, between(6, 10), between(6, 10), 2 + random_.below(4)); });
        scatter(some(12), 3.5, 4, reach,
                [&] { return scaffold(materials_, random_, between(4, 7), 1 + random_.below(4)); });
        scatter(some(3), 2.5, 10, 50, [&] { return pylon(materials_, between(10, 24)); });
        street_things(some(15));
        cables(2 + random_.below(4));
    }

    void city(const auto& some) {
        scatter(some(34), 7.5, 9, 65,
                [&] { return tower(materials_, random_, between(8, 12), between(8, 12), 3 + random_.below(8)); });
        scatter(some(8), 6, 7, 40,
                [&] { return pavilion(materials_, random_, between(6, 9), between(6, 9), 1 + random_.below(4)); });
        scatter(some(22), 1.5, 3, reach, [&] { return neon(materials_, random_); });
        street_things(some(13));
        cables(1 + random_.below(4));
    }

    /// One big room with pillars, niches, a gallery of pictures, and holes in its roof.
    void hall(const auto& some) {
        constexpr float half = 22, height = 6.5f;
        const int wall = materials_.any_wall(random_), ceiling = materials_.any_wall(random_);
        const float opening = between(1.5, 4);
        for (int side = 0; side < 4; ++side) {
            const M44f place(turn(V3d(0, side * pi / 2, 0)));
            Mesh& walls = mesh_of(statics_, wall);
            // Piers between openings, through which rooms behind are seen.
            for (float x = -half; x < half; x += 5.5f) {
                walls.add_box({x, 0, half}, {x + 5.5f - opening, height, half + 0.4f}, 3, place);
                walls.add_box({x + 5.5f - opening, 3.2f, half}, {x + 5.5f, height, half + 0.4f}, 3, place);
                Mesh& face = mesh_of(statics_, materials_.with_any_sign(random_).sign);
                const float middle = x + (5.5f - opening) / 2, wide = between(0.4, 0.45) * (5.5f - opening),
                            z = half - 0.03f;
                Mesh picture;
                picture.add_quad({V3f(middle + wide, 2.6f, z),
                                  {middle - wide, 2.6f, z},
                                  {middle - wide, 1.2f, z},
                                  {middle + wide, 1.2f, z}},
                                 V2f(0), V2f(1));
                face.append(picture, place);
                mesh_of(statics_, materials_.rail)
                    .add_box({middle - wide - 0.05f, 1.15f, z}, {middle + wide + 0.05f, 2.65f, z + 0.02f}, 1, place);
            }
            mesh_of(statics_, materials_.any_wall(random_))
                .add_box({-half - 5, 0, half + 5}, {half + 5, height, half + 5.3f}, 4, place);
        }
        Mesh& roof = mesh_of(statics_, ceiling);
        for (float x = -28; x < 28; x += 4) {
            for (float z = -28; z < 28; z += 4) {
                const bool hole = random_.below(5) == 0;
                if (!hole) roof.add_box({x, height, z}, {x + 4, height + 0.3f, z + 4}, 2);
                if (hole && random_.below(2)) {
                    mesh_of(statics_, materials_.pane)
                        .add_quad({V3f(x, height, z), {x + 4, height, z}, {x + 4, height, z + 4}, {x, height, z + 4}},
                                  V2f(0), V2f(1));
                }
                if (!hole && random_.below(3) == 0) {
                    mesh_of(statics_, materials_.lamp_glow)
                        .add_box({x + 1, height - 0.08f, z + 1.8f}, {x + 3, height - 0.02f, z + 2.2f}, 1);
                }
            }
        }
        scatter(some(26), 0.6, 3, 20, [&] {
            Mesh pillar{.material = materials_.any_wall(random_)};
            pillar.add_cylinder(V3f(0), {0, height, 0}, 0.4f, 0.35f, 20, 2, false);
            return Model{pillar};
        });
        street_things(some(12));
        scene_.environment.haze = 0.0005f;
        // What light comes in from everywhere lies on everything here.
        scene_.environment.zenith *= night_ ? 4.0f : 2.0f;
    }

    /// Moves as `motion` says, and cameras may follow it.
    void add_moving(Model model, const Scene::Motion& motion) {
        scene_.add_moving(std::move(model), motion);
        targets_.push_back([motion](double seconds) { return V3d(0) * motion(seconds); });
    }

    void moving_things(int count) {
        const double ceiling = theme_ == Theme::hall ? 4.5 : 14;
        const double far = theme_ == Theme::hall ? 16 : 0.8 * reach;
        for (int i = 0; i < count; ++i) {
            const auto spot = find_place(1.3, 2, far);
            if (!spot) continue;
            const V3d at(spot->x, ground(*spot) + random_.uniform(1.1, 2.2), spot->y);
            const V3d tilt(random_.uniform(-0.6, 0.6), angle(), random_.uniform(-0.6, 0.6));
            const double pace = random_.uniform(-3, 3), phase = angle(), swing = random_.uniform(0.2, 1);
            const int kind = random_.below(3);
            add_moving(sculpture(materials_, random_, between(0.5, 1)), [=](double seconds) {
                const V3d turned = kind == 0   ? V3d(0, pace * seconds + phase, 0)
                                   : kind == 1 ? V3d(pace * seconds, phase, 0)
                                               : V3d(swing * std::sin(2 * seconds + phase), phase, 0);
                const V3d moved = kind == 2 ? V3d(0, 0.4 * std::sin(3 * seconds + phase), 0) : V3d(0);
                return turn(turned) * placed(tilt, at + moved);
            });
        }
        for (int i = 2 + random_.below(5); i > 0; --i) {  // overhead, in circles
            const double radius = random_.uniform(3, far), height = random_.uniform(3, ceiling), phase = angle();
            const double pace = random_.uniform(2, 9) / radius * (random_.below(2) ? 1 : -1);
            add_moving(sculpture(materials_, random_, between(0.3, 0.7)), [=, this_ground = hills_](double seconds) {
                const double turn = phase + pace * seconds;
                return placed(V3d(0.3, -turn, 0.2),
                              {radius * std::cos(turn), height + this_ground + 0.4 * std::sin(3 * turn),
                               radius * std::sin(turn)});
            });
        }
        if (theme_ == Theme::hall || hills_ > 0) return;
        const Loop road = Loop::any(random_, {0, 0}, 0.95 * reach);
        for (int i = 3 + random_.below(4); i > 0; --i) {  // traffic around it all
            const double start = angle(), pace = random_.uniform(4, 12) / road.radius * (random_.below(2) ? 1 : -1);
            const double aside = random_.uniform(-0.04, 0.04);
            add_moving(car(materials_, random_), [=](double seconds) {
                Loop lane = road;
                lane.radius *= 1 + aside;
                const double turn = start + pace * seconds;
                const V2d here = lane.place(turn), ahead = lane.place(turn + std::copysign(0.01, pace)) - here;
                return placed(V3d(0, std::atan2(-ahead.y, ahead.x), 0), {here.x, 0, here.y});
            });
        }
    }

    void particles() {
        const V3f light = colors_.pick(random_, 0.6f);
        for (int i = random_.below(3); i > 0; --i) {
            if (const auto spot = find_place(0.5, 3, 0.7 * reach))
                add_smoke(scene_, random_, mix(light, V3f(0.5f), 0.7f), {spot->x, ground(*spot) + 0.3, spot->y});
        }
        for (int i = random_.below(3); i > 0; --i) {
            if (const auto spot = find_place(0.5, 3, 0.6 * reach))
                add_sparks(scene_, random_, V3f(1, 0.6f, 0.2f), {spot->x, ground(*spot) + 0.4, spot->y});
        }
        if (random_.below(3) == 0)
            add_flurry(scene_, random_, mix(light, V3f(0.9f), 0.6f), {0, 0, 0}, 0.6 * reach,
                       std::exp(random_.uniform(-1, 2.2)));
    }

    Scene& scene_;
    Random random_;
    Theme theme_;
    ColorScheme colors_;
    bool night_;
    Materials materials_;
    std::vector<Loop> loops_;
    std::vector<std::pair<V2d, double>> taken_;
    std::vector<Target> targets_;
    Model statics_;
    double hills_ = 0;
    int salt_ = 0;
};

}  // namespace

World make_invented_world(uint64_t seed, int path) {
    auto scene = std::make_unique<Scene>();
    Inventor inventor(*scene, seed);
    const Stage stage = inventor.invent();
    return roaming_world(std::move(scene), "procedural:" + std::to_string(seed), path, stage, inventor.targets());
}

}  // namespace clarus::render
