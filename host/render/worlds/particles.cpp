#include "render/worlds/particles.h"

#include <cmath>
#include <numbers>

namespace clarus::render {
namespace {

using Imath::M44d;
using Imath::V2f;
using Imath::V3d;
using Imath::V3f;

constexpr double two_pi = 2 * std::numbers::pi;

/// Two upright cards that cross.
void add_cards(Mesh& mesh, const V3f& center, float half_width, float half_height) {
    for (const V3f& side : {V3f(half_width, 0, 0), V3f(0, 0, half_width)}) {
        const V3f up(0, half_height, 0);
        mesh.add_quad({center - side - up, center + side - up, center + side + up, center - side + up}, V2f(0), V2f(1));
    }
}

double fraction(double x) { return x - std::floor(x); }

M44d turned_to(double turn, const V3d& place) {
    M44d matrix;
    matrix.rotate(V3d(0, turn, 0));
    for (int i = 0; i < 3; ++i) matrix[3][i] = place[i];
    return matrix;
}

}  // namespace

void add_smoke(Scene& scene, Random& random, const V3f& color, const V3d& from) {
    const int material = scene.add_material({.texture = invented_puff(random, color),
                                             .blended = true,
                                             .opacity = static_cast<float>(random.uniform(0.2, 0.6))});
    constexpr int puffs = 9;
    const double rise = random.uniform(0.6, 2), height = random.uniform(2.5, 6);
    const V3d wind(random.uniform(-0.3, 0.3), 0, random.uniform(-0.3, 0.3));
    for (int puff = 0; puff < puffs; ++puff) {
        Mesh cards{.material = material};
        const auto size = static_cast<float>(random.uniform(0.3, 0.8));
        add_cards(cards, V3f(0), size, size);
        const double start = (puff + random.uniform()) / puffs, spin = random.uniform(-0.8, 0.8);
        scene.add_moving({cards}, [=](double seconds) {
            const double risen = fraction(start + seconds * rise / height) * height;
            return turned_to(spin * seconds, from + V3d(0, risen, 0) + wind * risen);
        });
    }
}

void add_sparks(Scene& scene, Random& random, const V3f& color, const V3d& from) {
    const int material =
        scene.add_material({.texture = invented_puff(random, color), .emission = 4, .blended = true, .opacity = 1});
    for (int bunch = 0; bunch < 10; ++bunch) {
        Mesh cards{.material = material};
        for (int spark = 0; spark < 6; ++spark) {
            const V3d offset(random.uniform(-0.3, 0.3), random.uniform(-0.3, 0.3), random.uniform(-0.3, 0.3));
            add_cards(cards, V3f(offset), 0.025f, 0.05f);
        }
        const double turn = random.uniform(0, two_pi), speed = random.uniform(0.4, 1.6), start = random.uniform();
        const double up = random.uniform(2.5, 5), life = 2 * up / 9.81 + 0.15;
        scene.add_moving({cards}, [=](double seconds) {
            const double age = fraction(start + seconds / life) * life;
            return turned_to(turn, from + V3d(std::cos(turn) * speed, up - 4.9 * age, std::sin(turn) * speed) * age);
        });
    }
}

void add_flurry(Scene& scene, Random& random, const V3f& color, const V3d& around, double reach, double fall) {
    const int material = scene.add_material({.texture = invented_puff(random, color),
                                             .blended = true,
                                             .opacity = static_cast<float>(random.uniform(0.4, 0.9))});
    constexpr int layers = 6, height = 9;
    const bool streaks = fall > 4;
    const V3d wind(random.uniform(-0.6, 0.6), 0, random.uniform(-0.6, 0.6));
    for (int layer = 0; layer < layers; ++layer) {
        Mesh cards{.material = material};
        for (int i = 0; i < 70; ++i) {
            const V3d place(random.uniform(-reach, reach), random.uniform(0, 3), random.uniform(-reach, reach));
            const auto size = static_cast<float>(random.uniform(0.012, 0.035));
            add_cards(cards, V3f(place), streaks ? 0.4f * size : size, streaks ? 9 * size : size);
        }
        const double start = (layer + random.uniform()) / layers, turn = random.uniform(0, two_pi);
        scene.add_moving({cards}, [=](double seconds) {
            const double age = fraction(start + seconds * fall / height) * height / fall;
            return turned_to(turn, around + V3d(0, height - 2 - fall * age, 0) + wind * age);
        });
    }
}

}  // namespace clarus::render
