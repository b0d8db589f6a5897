#include "render/worlds/model_world.h"

#include <algorithm>

#include "render/worlds/daylight.h"
#include "render/worlds/import.h"
#include "render/worlds/procedural.h"
#include "render/worlds/seed.h"
#include "render/worlds/shots.h"

namespace clarus::render {

using Imath::M44f;
using Imath::V2f;
using Imath::V3f;

World make_model_world(const std::filesystem::path& file, int path) {
    World world{std::make_unique<Scene>(), {}};
    Scene& scene = *world.scene;
    Random random(seed_of(file.filename().string(), static_cast<uint64_t>(path)));
    scene.environment = daylight(random);
    const Model model = Importer(scene).load(file);

    const Bounds box = bounds(model);
    const float length = std::max({box.size().x, box.size().y, box.size().z, 1e-6f});
    const float scale = length < 2 || length > 2000 ? 20 / length : 1;
    M44f to_origin, to_metres;
    to_origin.setTranslation(-V3f(box.center().x, box.low.y, box.center().z));
    to_metres.setScale(scale);
    Model placed;
    append(placed, model, to_origin * to_metres);

    // A little lower than the model, which may have a ground of its own.
    Mesh plain;
    plain.material = scene.add_material({.texture = procedural_texture("grass")});
    constexpr float side = 60, depth = -0.02f;
    for (float x = -8; x < 8; ++x) {
        for (float z = -8; z < 8; ++z) {
            const V3f low(x * side, depth, z * side), high((x + 1) * side, depth, (z + 1) * side);
            plain.add_quad({V3f(low.x, depth, high.z), high, {high.x, depth, low.z}, low}, V2f(0), V2f(side / 4));
        }
    }
    mesh_of(placed, plain.material).append(plain);
    scene.add_static(placed);
    scene.build();

    const V3f size = box.size() * scale;
    const Stage stage{.center = {0, 0},
                      .reach = std::max(3.0f, 0.6f * std::max(size.x, size.z)),
                      .top = std::max(3.0f, 0.5f * size.y),
                      .look_from = size.y + 10};
    const Film film(scene, random, path, roaming_shots(scene, stage, {}));
    world.frame = [film](int frame) { return film.frame(frame); };
    return world;
}

}  // namespace clarus::render
