#include "render/worlds/world.h"

#include <filesystem>

#include "base/error.h"
#include "base/parse.h"
#include "render/worlds/action.h"
#include "render/worlds/demo_scene.h"
#include "render/worlds/interior.h"
#include "render/worlds/invented.h"
#include "render/worlds/model_world.h"
#include "render/worlds/torcs.h"

namespace clarus::render {
namespace {

uint64_t seed_in(const std::string& name, std::string_view text) {
    const std::optional<uint64_t> seed = parse_whole<uint64_t>(text);
    if (!seed) fail(ErrorKind::invalid_argument, "\"{}\": what follows the colon is not a whole number from 0", name);
    return *seed;
}

}  // namespace

std::vector<WorldKind> world_kinds() {
    std::string tracks;
    for (const std::string& track : torcs_tracks()) tracks += " " + track;
    if (tracks.empty()) tracks = " none yet, install torcs-data";
    return {
        {"demo", "a small town's square, another one for each path"},
        {"procedural:SEED", "made up from a number: towns, woods, deserts, works, by day and night"},
        {"action:SEED", "things that move and turn fast before patterned walls, fences and lamps, and stop"},
        {"torcs:TRACK", "race cars on a track of Debian's torcs-data:" + tracks},
        {"interior:SEED", "rooms with furniture of Debian's sweethome3d-furniture"},
        {"FILE", "any model that assimp reads (glTF, OBJ, AC3D, ...), or TORCS' .acc"},
    };
}

World make_world(const std::string& name, int path) {
    if (name == "demo") {
        const CameraPath way(path);
        return {make_demo_scene(path, way), [way](int frame) { return way.frame(frame); }};
    }
    const size_t colon = name.find(':');
    const std::string kind = name.substr(0, colon), rest = colon == std::string::npos ? "" : name.substr(colon + 1);
    if (colon != std::string::npos) {
        if (kind == "procedural") return make_invented_world(seed_in(name, rest), path);
        if (kind == "action") return make_action_world(seed_in(name, rest), path);
        if (kind == "torcs") return make_torcs_world(rest, path);
        if (kind == "interior") return make_interior_world(seed_in(name, rest), path);
    }
    if (std::filesystem::exists(name)) return make_model_world(name, path);
    std::string kinds;
    for (const WorldKind& known : world_kinds()) kinds += "\n  " + known.name + "  " + known.description;
    fail(ErrorKind::invalid_argument, "there is no scene \"{}\" and no such file; there are:{}", name, kinds);
}

}  // namespace clarus::render
