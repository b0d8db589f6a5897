#pragma once

#include <cstdint>
#include <string_view>

#include "render/random.h"

namespace clarus::render {

/// Of a Random that has nothing in common with those of other worlds and numbers.
inline uint64_t seed_of(std::string_view world, uint64_t number) {
    uint64_t hash = 0xcbf29ce484222325u;  // FNV-1a
    for (const unsigned char c : world) hash = (hash ^ c) * 0x100000001b3u;
    return Random(hash + number * 0xd1342543de82ef95u).bits();
}

}  // namespace clarus::render
