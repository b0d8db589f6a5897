#pragma once

#include <string>

namespace clarus {

/// A JSON of nlohmann's as text; bytes of names that are not UTF-8 become U+FFFD. `indent`: spaces a level, none for
/// one line.
template <typename Json>
std::string json_text(const Json& json, int indent = -1) {
    return json.dump(indent, ' ', false, Json::error_handler_t::replace);
}

}  // namespace clarus
