#include "render/worlds/model_world.h"

#include <algorithm>
#include <cmath>
#include <iterator>

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
    const double radius = std::hypot(size.x, size.z) / 2, height = size.y;
    const Stage stage{
        .reach = std::max(3.0, 1.2 * radius), .top = std::max(3.0, 0.5 * height), .look_from = height + 10};
    const ShotIdea around = [=](Random& shots, double now) {
        const Target middle = [=](double) { return Imath::V3d(0, 0.4 * height, 0); };
        return orbit(shots, middle, radius * shots.uniform(1.2, 2.2), 0.5 + height * shots.uniform(0, 1), now);
    };
    const ShotIdea held = [=](Random& shots, double now) {
        const CameraPose pose = around(shots, now)(now);
        return hand_held(
            shots, [=](double) { return pose; }, shots.uniform(1, 2));
    };
    std::vector<ShotIdea> ideas = {around, held};
    constexpr double a_place = 6;  // what is larger may be walked through
    if (radius > a_place) std::ranges::copy(roaming_shots(scene, stage, {}), std::back_inserter(ideas));
    world.frame = Film(scene, random, path, ideas);
    return world;
}

}  // namespace clarus::render
