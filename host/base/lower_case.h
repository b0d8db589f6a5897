#pragma once

#include <cctype>
#include <string>

namespace clarus {

/// With small letters for ASCII's capitals.
inline std::string lower_case(std::string text) {
    for (char& letter : text) letter = static_cast<char>(std::tolower(static_cast<unsigned char>(letter)));
    return text;
}

}  // namespace clarus
