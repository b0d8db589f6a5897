#pragma once

#include <span>
#include <string_view>

namespace clarus {

/// The name that was probably meant by a misspelt one: a few letters from it, whatever their case and what words are
/// joined by. Empty where none is near.
std::string_view nearest(std::string_view given, std::span<const std::string_view> names);

}  // namespace clarus
