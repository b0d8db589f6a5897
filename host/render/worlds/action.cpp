#include "render/worlds/action.h"

#include <string>

#include "render/worlds/action_actors.h"
#include "render/worlds/action_cloths.h"
#include "render/worlds/action_film.h"
#include "render/worlds/action_set.h"
#include "render/worlds/seed.h"

namespace clarus::render {

World make_action_world(uint64_t seed, int path) {
    Random random(seed_of("action", seed));
    const ActionKinds kinds = action_kinds(seed);
    auto scene = std::make_unique<Scene>();
    const ActionLight light = any_action_light(random);
    light_action_set(*scene, random, light);
    const bool dark = light == ActionLight::night || light == ActionLight::dark_room;
    ActionPaint paint(*scene, random, kinds.patterns, dark ? 1.0f : 0.0f);
    Model statics;
    build_action_set(random, paint, kinds.screens, light, statics);
    // One behind the other, so that none goes through another; the first ones are close, and the kinds come in turn.
    const int count = 6 + random.below(6), first = random.below(static_cast<int>(kinds.actors.size()));
    for (int i = 0; i < count; ++i) {
        const ActionActor kind = kinds.actors[static_cast<size_t>(first + i) % kinds.actors.size()];
        const double distance =
            kind == ActionActor::passer_by ? random.uniform(1.1, 2) : 2.4 + 6.2 * (i + random.uniform(0, 0.5)) / count;
        add_action_actor(*scene, random, paint, kind, distance, statics);
    }
    Random wind(seed_of("cloths of action", seed));
    ActionPaint dye(*scene, wind, kinds.patterns, dark ? 1.0f : 0.0f);
    for (int i = wind.below(3); i > 0; --i) {
        const ActionCloth kind = kinds.cloths[static_cast<size_t>(wind.below(static_cast<int>(kinds.cloths.size())))];
        const double distance = 2.4 + 6.2 * (wind.below(count) + 0.75) / count;  // between two actors
        add_action_cloth(*scene, wind, dye, kind, distance, statics);
    }
    scene->add_static(statics);
    scene->build();
    Random camera(seed_of("film of action:" + std::to_string(seed), static_cast<uint64_t>(path)));
    return {std::move(scene), ActionFilm(camera)};
}

}  // namespace clarus::render
