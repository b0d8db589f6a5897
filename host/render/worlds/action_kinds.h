#pragma once

#include <cstdint>
#include <span>

namespace clarus::render {

// What the worlds `action:SEED` are made of.

/// Patterns of walls, floors, posters and of what moves.
enum class ActionPattern { print, bricks, checks, stripes, dots, blocks, rings, zigzag, scales, table };
/// What moves on its own.
enum class ActionActor { ball, box, wheel, pendulum, fan, label, passer_by, wire, gear, cage, star, ladder };
/// Cloth in the wind.
enum class ActionCloth { flag, curtain, ribbon };
/// What is seen through, before the wall.
enum class ActionScreen { chain_link, louvres, foliage, wires, netting, beads, trellis };

/// Seeds from here on are for pictures that are held out: nothing of what they choose from is chosen by smaller seeds.
constexpr uint64_t first_reserved_action_seed = 900;

/// What a seed chooses from.
struct ActionKinds {
    std::span<const ActionPattern> patterns;
    std::span<const ActionActor> actors;
    std::span<const ActionScreen> screens;
    std::span<const ActionCloth> cloths;
};
ActionKinds action_kinds(uint64_t seed);

}  // namespace clarus::render
