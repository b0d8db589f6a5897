#pragma once

#include <charconv>
#include <optional>
#include <string_view>

#include "clarus/types.h"

namespace clarus {

/// A whole number that is all of the text; nothing where it is not, or does not fit.
template <class Integer>
std::optional<Integer> parse_whole(std::string_view text) {
    Integer value{};
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
    return value;
}

/// A real number that is all of the text, or "inf"; nothing where it is not.
inline std::optional<double> parse_number(std::string_view text) {
    double value{};
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc{} || end != text.data() + text.size() || value != value) return std::nullopt;
    return value;
}

/// "WIDTHxHEIGHT", both from 1.
inline std::optional<Size> parse_size(std::string_view text) {
    const size_t cross = text.find('x');
    if (cross == std::string_view::npos) return std::nullopt;
    const auto width = parse_whole<int>(text.substr(0, cross)), height = parse_whole<int>(text.substr(cross + 1));
    if (!width || !height || *width < 1 || *height < 1) return std::nullopt;
    return Size{*width, *height};
}

}  // namespace clarus
