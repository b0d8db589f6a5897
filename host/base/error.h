#pragma once

#include <fmt/format.h>

#include <utility>

#include "clarus/error.h"

namespace clarus {

/// Throws Error{kind} with a formatted message.
template <typename... Args>
[[noreturn]] void fail(ErrorKind kind, fmt::format_string<Args...> format, Args&&... args) {
    throw Error(kind, fmt::format(format, std::forward<Args>(args)...));
}

}  // namespace clarus
