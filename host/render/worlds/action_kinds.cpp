#include "render/worlds/action_kinds.h"

#include <array>

namespace clarus::render {
namespace {

using enum ActionPattern;
using enum ActionActor;
using enum ActionScreen;
using enum ActionCloth;

constexpr std::array patterns = {print, bricks, checks, stripes, dots, blocks};
constexpr std::array actors = {ball, box, wheel, pendulum, fan, label, passer_by, wire};
constexpr std::array screens = {chain_link, louvres, foliage, wires};
constexpr std::array cloths = {flag, curtain};

constexpr std::array reserved_patterns = {rings, zigzag, scales, table};
constexpr std::array reserved_actors = {gear, cage, star, ladder};
constexpr std::array reserved_screens = {netting, beads, trellis};
constexpr std::array reserved_cloths = {ribbon};

}  // namespace

ActionKinds action_kinds(uint64_t seed) {
    if (seed >= first_reserved_action_seed)
        return {reserved_patterns, reserved_actors, reserved_screens, reserved_cloths};
    return {patterns, actors, screens, cloths};
}

}  // namespace clarus::render
