#pragma once

#include <cstdint>
#include <string_view>

namespace clarus::render {

/// For a Random of its own for every world and path.
inline uint64_t seed_of(std::string_view world, int path) {
    uint64_t hash = 0xcbf29ce484222325u;  // FNV-1a
    for (const unsigned char c : world) hash = (hash ^ c) * 0x100000001b3u;
    return hash + static_cast<uint64_t>(path) * 0x9e3779b97f4a7c15u * 3;
}

}  // namespace clarus::render
