#include "render/worlds/interior.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "render/worlds/daylight.h"
#include "render/worlds/furniture.h"
#include "render/worlds/invented_things.h"
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

constexpr float pi = std::numbers::pi_v<float>;
constexpr float half_wall = 0.1f, door_height = 2.1f;

struct Opening {
    float left, right, low, high;
};

/// From the origin along x, its face towards +z at z = 0; in pieces, so that shade can differ along it.
void add_wall(Mesh& mesh, float length, float height, std::vector<Opening> openings, const M44f& place) {
    const auto fill = [&](float left, float right, float low, float high) {
        const int pieces = std::max(1, static_cast<int>((right - left) / 0.7f));
        for (int i = 0; i < pieces && high - low > 0.01f; ++i) {
            const auto x = [&](int k) {
                return std::lerp(left, right, static_cast<float>(k) / static_cast<float>(pieces));
            };
            mesh.add_box({x(i), low, -half_wall}, {x(i + 1), high, 0}, 1.8f, place);
        }
    };
    std::ranges::sort(openings, {}, &Opening::left);
    float at = 0;
    for (const Opening& opening : openings) {
        fill(at, opening.left, 0, height);
        fill(opening.left, opening.right, 0, opening.low);
        fill(opening.left, opening.right, opening.high, height);
        at = opening.right;
    }
    fill(at, length, 0, height);
}

class Flat {
  public:
    Flat(Scene& scene, uint64_t seed)
        : scene_(scene),
          random_(seed_of("interior", seed)),
          colors_(random_),
          night_(random_.below(4) == 0),
          materials_(scene, random_, colors_, night_),
          importer_(scene),
          catalogue_(read_installed_furniture()) {}

    Stage furnish() {
        columns_ = 2 + random_.below(2);
        width_ = between(4.6, 6.4);
        depth_ = between(4.6, 6.4);
        height_ = between(2.5, 3.2);
        light();
        lay_way();
        const std::array kinds = {"Living room", "Kitchen", "Bedroom", "Office", "Living room", "Bathroom"};
        const int first = random_.below(6);
        for (int row = 0; row < 2; ++row) {
            for (int column = 0; column < columns_; ++column) {
                build_room(column, row, kinds[static_cast<size_t>(first + 2 * column + 3 * row) % kinds.size()]);
            }
        }
        surroundings();
        scene_.add_static(statics_);
        return {.center = {columns_ * width_ / 2.0, depth_ * 1.0},
                .reach = 0.8 * depth_,
                .top = 1.1,
                .look_from = height_ - 0.3,
                .ways = {way_}};
    }

    const std::vector<Target>& targets() const { return targets_; }

  private:
    float between(double low, double high) { return static_cast<float>(random_.uniform(low, high)); }

    void light() {
        Environment& environment = scene_.environment;
        environment = daylight(random_);
        environment.haze = 0.0002f;
        // Lamps are not traced: what they and the windows give comes from everywhere.
        const V3f lamps = V3f(1, 0.85f, 0.65f) * between(0.9, 1.7);
        environment.ground = lamps * 0.55f;
        if (night_) {
            environment.sun *= 0.03f;
            environment.zenith = lamps * 0.9f;
            environment.horizon = V3f(0.02f, 0.025f, 0.05f);
            environment.clouds = std::make_shared<Texture>(0, [](float, float) { return Rgba{0, 0, 0, 1}; });
        } else {
            environment.zenith += lamps * 0.7f;
        }
    }

    V2d center(int column, int row) const { return {(column + 0.5) * width_, (row + 0.5) * depth_}; }

    /// Through every room and door: there along the first row, back along the second.
    void lay_way() {
        std::vector<V2d> corners;
        const auto visit = [&](int column, int row) {
            const V2d wobble(random_.uniform(-0.5, 0.5), random_.uniform(-0.5, 0.5));
            corners.push_back(center(column, row) + wobble);
        };
        for (int column = 0; column < columns_; ++column) {
            if (column > 0) corners.push_back((center(column - 1, 0) + center(column, 0)) / 2);
            visit(column, 0);
        }
        corners.push_back((center(columns_ - 1, 0) + center(columns_ - 1, 1)) / 2);
        for (int column = columns_ - 1; column >= 0; --column) {
            visit(column, 1);
            if (column > 0) corners.push_back((center(column, 1) + center(column - 1, 1)) / 2);
        }
        corners.push_back((center(0, 1) + center(0, 0)) / 2);
        const auto points = std::make_shared<std::vector<V2d>>(corners);
        const double spacing = (width_ + depth_) / 4;
        way_ = [points, spacing](double metres) {
            const double at = metres / spacing, floor = std::floor(at), t = at - floor;
            const auto count = static_cast<long long>(points->size());
            const auto point = [&](int step) {
                return (*points)[static_cast<size_t>(((static_cast<long long>(floor) + step) % count + count) % count)];
            };
            const V2d p0 = point(-1), p1 = point(0), p2 = point(1), p3 = point(2);
            const V2d here =
                p1 + ((p2 - p0) + ((p0 * 2 - p1 * 5 + p2 * 4 - p3) + (p1 * 3 - p0 - p2 * 3 + p3) * t) * t) * (t / 2);
            return V3d(here.x, 0.01, here.y);
        };
        way_length_ = spacing * static_cast<double>(corners.size());
    }

    bool free(const V2d& low, const V2d& high) const {
        constexpr double elbow = 0.42;
        for (double metres = 0; metres < way_length_; metres += 0.2) {
            const V3d at = way_(metres);
            if (at.x > low.x - elbow && at.x < high.x + elbow && at.z > low.y - elbow && at.z < high.y + elbow)
                return false;
        }
        return std::ranges::none_of(taken_, [&](const auto& other) {
            return low.x < other.second.x && high.x > other.first.x && low.y < other.second.y && high.y > other.first.y;
        });
    }

    int any_paper() {
        return std::array{materials_.white_paint, materials_.plaster,
                          materials_.any_wall(random_)}[static_cast<size_t>(random_.below(3))];
    }

    /// With walls of its own half thickness; a room's sides are −z, +x, +z, −x.
    void build_room(int column, int row, const std::string& kind) {
        const V3f middle(static_cast<float>(center(column, row).x), 0, static_cast<float>(center(column, row).y));
        const int wall = any_paper(), floor = materials_.any_wall(random_);
        const std::array neighbour = {row == 1, column + 1 < columns_, row == 0, column > 0};
        // Between the rows there are doors at the ends only: the way through goes round.
        const bool end = column == 0 || column == columns_ - 1;
        for (int side = 0; side < 4; ++side) {
            const float length = side % 2 ? depth_ : width_, away = (side % 2 ? width_ : depth_) / 2 - half_wall;
            M44f place =
                move(V3f(-length / 2, 0, -away)) * placed(V3f(0, -static_cast<float>(side) * pi / 2, 0), middle);
            std::vector<Opening> openings;
            const float half = length / 2;
            if (neighbour[static_cast<size_t>(side)]) {
                if (side % 2 || end) openings.push_back({half - 0.5f, half + 0.5f, 0, door_height});
            } else {
                windows(openings, length);
                for (const Opening& window : openings) add_window(window, place);
            }
            add_wall(mesh_of(statics_, wall), length, height_, openings, place);
            pictures(openings, length, place);
        }
        lay_floor(floor, middle);
        ceiling(middle);
        furniture(kind, middle);
    }

    void windows(std::vector<Opening>& openings, float length) {
        const int count = 1 + random_.below(2);
        for (int i = 0; i < count; ++i) {
            const float at = length * (static_cast<float>(i) + 0.5f) / static_cast<float>(count),
                        half = between(0.4, 0.8);
            openings.push_back({at - half, at + half, between(0.3, 1), between(1.9, 2.3)});
        }
    }

    void add_window(const Opening& w, const M44f& place) {
        Mesh& frame = mesh_of(statics_, materials_.white_paint);
        constexpr float bar = 0.04f, z = -0.06f;
        frame.add_box({w.left, w.low, z}, {w.left + bar, w.high, z + bar}, 1, place);
        frame.add_box({w.right - bar, w.low, z}, {w.right, w.high, z + bar}, 1, place);
        frame.add_box({w.left, w.high - bar, z}, {w.right, w.high, z + bar}, 1, place);
        frame.add_box({w.left - 0.05f, w.low - 0.03f, z}, {w.right + 0.05f, w.low, 0.1f}, 1, place);
        const float middle = (w.left + w.right) / 2;
        frame.add_box({middle - bar / 2, w.low, z}, {middle + bar / 2, w.high, z + bar}, 1, place);
        Mesh glass;
        glass.add_quad({V3f(w.left, w.high, z), {w.right, w.high, z}, {w.right, w.low, z}, {w.left, w.low, z}}, V2f(0),
                       V2f(1));
        mesh_of(statics_, materials_.pane).append(glass, place);
        if (random_.below(3)) return;
        for (float y = w.low + 0.05f; y < w.high; y += 0.06f) {  // a blind
            frame.add_box({w.left + bar, y, -0.02f}, {w.right - bar, y + 0.004f, 0.015f}, 1, place);
        }
    }

    void pictures(const std::vector<Opening>& openings, float length, const M44f& place) {
        for (int i = random_.below(3); i > 0; --i) {
            const float at = between(0.6, length - 0.6), half = between(0.2, 0.45), low = between(1.3, 1.5);
            const bool covered = std::ranges::any_of(
                openings, [&](const Opening& o) { return at + half > o.left - 0.1f && at - half < o.right + 0.1f; });
            if (covered) continue;
            Mesh picture;
            picture.add_quad({V3f(at - half, low + 0.6f, 0.03f),
                              {at + half, low + 0.6f, 0.03f},
                              {at + half, low, 0.03f},
                              {at - half, low, 0.03f}},
                             V2f(0), V2f(1));
            mesh_of(statics_, random_.below(2) ? materials_.with_any_sign(random_).sign : materials_.any_wall(random_))
                .append(picture, place);
            mesh_of(statics_, materials_.rail)
                .add_box({at - half - 0.02f, low - 0.02f, 0.005f}, {at + half + 0.02f, low + 0.62f, 0.025f}, 1, place);
        }
    }

    /// In small squares, so that shade shows under things.
    void lay_floor(int material, const V3f& middle) {
        constexpr float side = 0.35f;
        Mesh& mesh = mesh_of(statics_, material);
        const V3f low = middle - V3f(width_ / 2, 0, depth_ / 2), high = middle + V3f(width_ / 2, 0, depth_ / 2);
        const float repeat = between(0.8, 2);
        for (float x = low.x; x < high.x - 0.01f; x += side) {
            for (float z = low.z; z < high.z - 0.01f; z += side) {
                const float right = std::min(x + side, high.x), front = std::min(z + side, high.z);
                mesh.add_quad({V3f(x, 0, front), {right, 0, front}, {right, 0, z}, {x, 0, z}}, V2f(x, front) / repeat,
                              V2f(right, z) / repeat);
            }
        }
    }

    void ceiling(const V3f& middle) {
        mesh_of(statics_, materials_.white_paint)
            .add_box(middle + V3f(-width_ / 2, height_, -depth_ / 2),
                     middle + V3f(width_ / 2, height_ + 0.2f, depth_ / 2), 2);
        if (random_.below(2)) {
            mesh_of(statics_, materials_.lamp_glow)
                .add_box(middle + V3f(-0.5f, height_ - 0.06f, -0.1f), middle + V3f(0.5f, height_ - 0.02f, 0.1f), 1);
            return;
        }
        // A fan.
        const double pace = random_.uniform(3, 9);
        const V3d hub(middle.x, height_ - 0.35, middle.z);
        Model blades;
        append(blades, rotor(materials_, 0.6f), M44f(0.99f, 0, 0, 0, 0, 0, 0.99f, 0, 0, -0.99f, 0, 0, 0, 0, 0, 1));
        scene_.add_moving(std::move(blades), [=](double seconds) {
            M44d turn;
            turn.rotate(V3d(0, pace * seconds, 0));
            for (int i = 0; i < 3; ++i) turn[3][i] = hub[i];
            return turn;
        });
        mesh_of(statics_, materials_.rail).add_cylinder(V3f(hub), V3f(hub) + V3f(0, 0.35f, 0), 0.03f, 0.03f, 8, 1);
    }

    void put(const Model& model, float heading, const V3f& at) {
        append(statics_, model, placed(V3f(0, heading, 0), at));
    }

    const Model& model_of(const Furniture& piece) {
        auto& model = models_[piece.model];
        if (model.empty()) model = load_furniture(importer_, piece);
        return model;
    }

    const Furniture* any_piece(const std::string& category, const auto& fits) {
        std::vector<const Furniture*> choice;
        for (const Furniture& piece : catalogue_) {
            if ((category.empty() || piece.category == category) && fits(piece)) choice.push_back(&piece);
        }
        return choice.empty() ? nullptr : choice[static_cast<size_t>(random_.below(static_cast<int>(choice.size())))];
    }

    void furniture(const std::string& kind, const V3f& middle) {
        const auto stands = [this](const Furniture& p) {
            return p.elevation < 0.05f && p.size.y > 0.3f && p.size.y < height_ &&
                   std::max(p.size.x, p.size.z) > 0.35f && std::max(p.size.x, p.size.z) < 2.6f;
        };
        for (int i = 0; i < 14; ++i) {
            const bool lamp = i == 3;
            const Furniture* piece = any_piece(lamp ? "Lights" : kind, stands);
            if (!piece) continue;
            const bool at_wall = random_.below(5) > 0;
            for (int attempt = 0; attempt < 14; ++attempt) {
                const int side = random_.below(4);
                const V2d half =
                    V2d(side % 2 ? piece->size.z : piece->size.x, side % 2 ? piece->size.x : piece->size.z) / 2.0;
                const V2d room(width_ / 2 - half_wall - 0.02, depth_ / 2 - half_wall - 0.02), most = room - half;
                if (most.x < 0 || most.y < 0) break;
                V2d at(random_.uniform(-most.x, most.x), random_.uniform(-most.y, most.y));
                // Its back to the wall: sides are −z, −x, +z, +x, as headings turn.
                if (at_wall)
                    (side % 2 ? at.x : at.y) = (side == 0 || side == 1 ? -1 : 1) * (side % 2 ? most.x : most.y);
                at += V2d(middle.x, middle.z);
                if (!free(at - half, at + half)) continue;
                taken_.push_back({at - half, at + half});
                const float heading = static_cast<float>(side) * pi / 2;
                const V3f place(static_cast<float>(at.x), 0, static_cast<float>(at.y));
                put(model_of(*piece), heading, place);
                if (piece->top > 0.2f && piece->top < 1.3f) set_table(*piece, place, V2f(half));
                break;
            }
        }
        // Something that moves on the floor, too.
        if (random_.below(2)) {
            const V3d at(middle.x + random_.uniform(-1, 1) * 0.3 * width_, random_.uniform(1, 1.6),
                         middle.z + random_.uniform(-1, 1) * 0.3 * depth_);
            const double pace = random_.uniform(-3, 3);
            const V2d half(0.35, 0.35), spot(at.x, at.z);
            if (!free(spot - half, spot + half)) return;
            taken_.push_back({spot - half, spot + half});
            mesh_of(statics_, materials_.any_wall(random_))
                .add_box(V3f(at) - V3f(0.2f, static_cast<float>(at.y), 0.2f), V3f(at) + V3f(0.2f, -0.4f, 0.2f), 1);
            scene_.add_moving(sculpture(materials_, random_, 0.32f), [=](double seconds) {
                M44d turn;
                turn.rotate(V3d(0.4, pace * seconds, 0));
                for (int i = 0; i < 3; ++i) turn[3][i] = at[i];
                return turn;
            });
            targets_.push_back([at](double) { return at; });
        }
    }

    void set_table(const Furniture& table, const V3f& at, const V2f& half) {
        for (int i = random_.below(4); i > 0; --i) {
            const Furniture* thing = any_piece("", [&](const Furniture& p) {
                return p.elevation < 0.05f &&
                       std::max(p.size.x, p.size.z) < std::min(0.45f, std::min(half.x, half.y)) && p.size.y < 0.6f &&
                       p.size.y > 0.05f && p.category != "Exterior";
            });
            if (!thing) return;
            const V3f place = at + V3f(between(-0.6, 0.6) * half.x, table.top, between(-0.6, 0.6) * half.y);
            put(model_of(*thing), between(0, 6.28), place);
        }
    }

    /// A garden before the windows.
    void surroundings() {
        const V2d middle(columns_ * width_ / 2.0, depth_);
        Mesh& lawn = mesh_of(statics_, materials_.lawn);
        for (int x = -5; x < 5; ++x) {
            for (int z = -5; z < 5; ++z) {
                const auto left = static_cast<float>(middle.x) + 16.0f * static_cast<float>(x),
                           back = static_cast<float>(middle.y) + 16.0f * static_cast<float>(z);
                lawn.add_quad({V3f(left, -0.3f, back + 16),
                               {left + 16, -0.3f, back + 16},
                               {left + 16, -0.3f, back},
                               {left, -0.3f, back}},
                              V2f(0), V2f(5));
            }
        }
        for (int i = 0; i < 26; ++i) {
            const double turn = random_.uniform(0, 2 * pi),
                         far = random_.uniform(1.6, 4) * std::max<double>(depth_, columns_ * width_ / 2);
            const V3f at(static_cast<float>(middle.x + far * std::cos(turn)), -0.3f,
                         static_cast<float>(middle.y + far * std::sin(turn)));
            put(random_.below(3) ? tree(materials_, random_) : conifer(materials_, random_), 0, at);
        }
    }

    Scene& scene_;
    Random random_;
    ColorScheme colors_;
    bool night_;
    Materials materials_;
    Importer importer_;
    std::vector<Furniture> catalogue_;
    std::map<std::string, Model> models_;
    std::vector<std::pair<V2d, V2d>> taken_;
    std::vector<Target> targets_;
    Model statics_;
    Way way_;
    double way_length_ = 0;
    int columns_ = 2;
    float width_ = 5, depth_ = 5, height_ = 2.7f;
};

}  // namespace

World make_interior_world(uint64_t seed, int path) {
    auto scene = std::make_unique<Scene>();
    Flat flat(*scene, seed);
    const Stage stage = flat.furnish();
    return roaming_world(std::move(scene), "interior:" + std::to_string(seed), path, stage, flat.targets());
}

}  // namespace clarus::render
