#pragma once

#include <fmt/format.h>

#include <initializer_list>
#include <string>
#include <utility>

#include "clarus/error.h"
#include "clarus/types.h"

namespace clarus::python {

/// Which of an enumeration's values a word means. Errors: invalid_argument, naming `argument`.
template <typename Enum>
Enum value_of(const char* argument, const std::string& word,
              std::initializer_list<std::pair<const char*, Enum>> values) {
    std::string words;
    for (const auto& [name, value] : values) {
        if (word == name) return value;
        words += (words.empty() ? "" : ", ") + std::string(name);
    }
    throw Error(ErrorKind::invalid_argument, fmt::format("{}: \"{}\"; there are {}", argument, word, words));
}

inline ColorSpace color_space_of(const std::string& word) {
    return value_of<ColorSpace>("color_space", word, {{"srgb", ColorSpace::srgb}, {"linear", ColorSpace::linear}});
}

}  // namespace clarus::python
