#include "base/hash.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <xxhash.h>

#include <algorithm>

namespace clarus {

Hash hash_of(std::string_view bytes) {
    XXH128_canonical_t canonical;
    XXH128_canonicalFromHash(&canonical, XXH3_128bits(bytes.data(), bytes.size()));
    Hash hash;
    std::copy_n(canonical.digest, hash.size(), hash.begin());
    return hash;
}

Hash hash_of_parts(std::initializer_list<std::string_view> parts) {
    std::string joined;
    for (const std::string_view part : parts) {
        joined += fmt::format("{}:", part.size());
        joined += part;
    }
    return hash_of(joined);
}

std::string hexadecimal(const Hash& hash) { return fmt::format("{:02x}", fmt::join(hash, "")); }

}  // namespace clarus
