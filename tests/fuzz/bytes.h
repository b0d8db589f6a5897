#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

using Bytes = std::span<const uint8_t>;

/// The first bytes, as many as asked for where there are so many, which are then gone from the rest.
inline Bytes take(Bytes& bytes, size_t count) {
    const Bytes first = bytes.first(std::min(count, bytes.size()));
    bytes = bytes.subspan(first.size());
    return first;
}
