#include "base/nearest.h"

#include <algorithm>
#include <cctype>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

namespace clarus {
namespace {

/// Letters in small, digits; what words are joined by does not tell names apart.
std::string bare(std::string_view name) {
    std::string result;
    for (const unsigned char c : name)
        if (std::isalnum(c)) result += static_cast<char>(std::tolower(c));
    return result;
}

/// How many letters are put in, left out or replaced to make one of the other.
size_t edit_distance(std::string_view from, std::string_view to) {
    std::vector<size_t> row(to.size() + 1);
    std::iota(row.begin(), row.end(), size_t{0});
    for (size_t i = 0; i < from.size(); ++i) {
        size_t diagonal = std::exchange(row[0], i + 1);
        for (size_t j = 0; j < to.size(); ++j) {
            const size_t replaced = diagonal + (from[i] != to[j]);
            diagonal = row[j + 1];
            row[j + 1] = std::min({replaced, row[j] + 1, row[j + 1] + 1});
        }
    }
    return row.back();
}

}  // namespace

std::string_view nearest(std::string_view given, std::span<const std::string_view> names) {
    constexpr size_t longest = 64;
    if (given.size() > longest) return {};
    std::string_view best;
    size_t least = std::string_view::npos;
    for (const std::string_view name : names) {
        const size_t distance = edit_distance(bare(given), bare(name));
        if (distance < least && distance <= 1 + name.size() / 4) least = distance, best = name;
    }
    return best;
}

}  // namespace clarus
