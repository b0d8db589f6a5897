#pragma once

#include <array>
#include <initializer_list>
#include <string>
#include <string_view>

namespace clarus {

/// XXH3-128, in its canonical order of bytes: equal on every machine.
using Hash = std::array<unsigned char, 16>;

Hash hash_of(std::string_view bytes);
/// Parts are kept apart: {"ab", "c"} and {"a", "bc"} have different hashes.
Hash hash_of_parts(std::initializer_list<std::string_view> parts);

/// 32 digits.
std::string hexadecimal(const Hash& hash);

}  // namespace clarus
