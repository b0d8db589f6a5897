#pragma once

#include <algorithm>
#include <cstddef>
#include <cstring>

#include "base/error.h"
#include "clarus/clarus.h"

// Structs that begin with their size: a program may know less of them than this library, or more.
namespace clarus::c {

/// As much of a struct as both sides know, over the usual values. `from` may be smaller or larger than what this
/// library knows. Errors: invalid_argument, where something is set that this library does not know.
template <typename Struct>
Struct known(const Struct* from, Struct usual, const char* name) {
    if (!from) return usual;
    const size_t size = from->struct_size;
    if (size < sizeof from->struct_size)
        fail(ErrorKind::invalid_argument, "{}.struct_size is {}; begin with clarus_default_{}()", name, size, name);
    const std::byte* bytes = reinterpret_cast<const std::byte*>(from);
    if (size > sizeof usual &&
        std::any_of(bytes + sizeof usual, bytes + size, [](std::byte byte) { return byte != std::byte{}; }))
        fail(ErrorKind::invalid_argument, "{} has set what came after version {} of the library", name,
             CLARUS_VERSION_STRING);
    std::memcpy(&usual, bytes, std::min(size, sizeof usual));
    return usual;
}

/// Writes the usual values, as many bytes as the program has; what it has beyond becomes 0. `to` may be null.
template <typename Struct>
void set_usual(Struct* to, Struct usual, size_t struct_size) {
    if (!to) return;
    usual.struct_size = struct_size;
    std::memset(static_cast<void*>(to), 0, struct_size);
    std::memcpy(static_cast<void*>(to), &usual, std::min(struct_size, sizeof usual));
}

}  // namespace clarus::c
