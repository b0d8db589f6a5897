#include "render/worlds/action_cloths.h"

#include <cmath>
#include <numbers>
#include <span>

#include "render/worlds/action_actors.h"

namespace clarus::render {
namespace {

using Imath::V2d;
using Imath::V2f;
using Imath::V3d;
using Imath::V3f;

constexpr double pi = std::numbers::pi;

/// A cloth's grid of vertices by (u, v) in [0, 1]², with the texture once over it.
Mesh grid(int material, int columns, int rows) {
    Mesh mesh{.material = material};
    const auto stride = static_cast<uint32_t>(columns) + 1;
    for (int row = 0; row <= rows; ++row) {
        for (int column = 0; column <= columns; ++column) {
            mesh.positions.push_back(V3f(0));
            mesh.normals.push_back(V3f(0, 0, 1));
            mesh.uvs.push_back(V2f(static_cast<float>(column) / static_cast<float>(columns),
                                   static_cast<float>(row) / static_cast<float>(rows)));
            if (column == columns || row == rows) continue;
            const auto corner = static_cast<uint32_t>(mesh.positions.size() - 1);
            mesh.triangles.push_back({corner, corner + 1, corner + stride + 1});
            mesh.triangles.push_back({corner, corner + stride + 1, corner + stride});
        }
    }
    return mesh;
}

/// Adds a cloth whose places are a function of (u, v) and time.
template <typename Place>
void add_cloth(Scene& scene, Mesh mesh, const Place& place) {
    scene.add_deforming(std::move(mesh), [place, uvs = mesh.uvs](double seconds, std::span<V3f> positions) {
        for (size_t i = 0; i < positions.size(); ++i) positions[i] = V3f(place(V2d(uvs[i]), seconds));
    });
}

}  // namespace

void add_action_cloth(Scene& scene, Random& random, ActionPaint& paint, ActionCloth kind, double distance,
                      Model& statics) {
    const int cloth = paint.patterned(true), iron = paint.plain();
    const double aside = random.uniform(-0.5, 0.5) * distance, z = action_eye.z - distance;
    const double length = random.uniform(0.2, 0.4) * distance, heading = random.uniform(-0.9, 0.9);
    const double waves = random.uniform(4, 9), swing = random.uniform(0.06, 0.14) * length,
                 phase = random.uniform(0, 6);
    // Pixels of a picture of 144 rows in a thirtieth of a second, at the free end.
    const double pixels = random.uniform(5, 18), rate = pixels * distance / action_focal * 30 / (2 * swing);
    const V3d along(std::cos(heading), 0, std::sin(heading)), across(-along.z, 0, along.x);
    Mesh& holder = mesh_of(statics, iron);
    switch (kind) {
        case ActionCloth::flag: {  // on a pole, its stripes running away from there
            const double height = length * random.uniform(0.5, 0.8),
                         top = action_eye.y + random.uniform(0, 0.4) * distance;
            const V3d pole(aside, top, z);
            holder.add_cylinder({static_cast<float>(aside), 0, static_cast<float>(z)}, V3f(pole) + V3f(0, 0.1f, 0),
                                0.03f, 0.025f, 8, 1);
            return add_cloth(scene, grid(cloth, 28, 10), [=](const V2d& uv, double seconds) {
                const double wave = waves * uv.x - rate * seconds + phase, free = uv.x;
                return pole + along * (0.9 * length * uv.x) +
                       across * (1.5 * swing * free * std::sin(wave + 0.8 * uv.y)) -
                       V3d(0, height * uv.y + 0.15 * length * uv.x * uv.x + swing * free * std::cos(wave), 0);
            });
        }
        case ActionCloth::curtain: {  // from a bar, waving below
            const double height = 1.4 * length, top = action_eye.y + random.uniform(0.1, 0.4) * distance;
            const V3d bar(aside, top, z);
            holder.add_cylinder(V3f(bar - along * length), V3f(bar + along * length), 0.025f, 0.025f, 8, 1);
            return add_cloth(scene, grid(cloth, 28, 14), [=](const V2d& uv, double seconds) {
                const double wave = 1.5 * waves * uv.x - rate * seconds + phase, free = uv.y;
                return bar +
                       along * (length * (2 * uv.x - 1) + 2 * swing * free * std::sin(rate * seconds - 2 * free)) +
                       across * (swing * (0.4 + free) * std::sin(wave)) - V3d(0, height * uv.y, 0);
            });
        }
        case ActionCloth::ribbon: {  // long and narrow, in loops
            const double width = 0.16 * length;
            const V3d start(aside, action_eye.y + random.uniform(-0.1, 0.3) * distance, z);
            holder.add_sphere(V3f(start), 0.05f, 12, 1);
            return add_cloth(scene, grid(cloth, 64, 2), [=](const V2d& uv, double seconds) {
                const double wave = 2 * waves * uv.x - rate * seconds + phase, free = std::sqrt(uv.x);
                const double turned = 2 * pi * uv.x + 0.5 * std::sin(wave);
                return start + along * (2 * length * uv.x) +
                       (across * std::cos(wave) + V3d(0, std::sin(wave), 0)) * (1.5 * swing * free) +
                       (across * std::sin(turned) + V3d(0, std::cos(turned), 0)) * (width * (uv.y - 0.5));
            });
        }
    }
}

}  // namespace clarus::render
