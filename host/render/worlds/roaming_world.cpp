#include "render/worlds/roaming_world.h"

#include <utility>

#include "render/worlds/seed.h"

namespace clarus::render {

World roaming_world(std::unique_ptr<Scene> scene, const std::string& name, int path, const Stage& stage,
                    const std::vector<Target>& targets) {
    scene->build();
    Random random(seed_of("film of " + name, static_cast<uint64_t>(path)));
    Film film(*scene, random, path, roaming_shots(*scene, stage, targets));
    return {std::move(scene), std::move(film)};
}

}  // namespace clarus::render
