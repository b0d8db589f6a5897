#pragma once

#include <fmt/format.h>

#include <utility>

#include "clarus/log.h"

namespace clarus {

/// Hands a finished message to the callback of set_log_callback.
void log_message(LogLevel level, std::string_view message);

template <typename... Args>
void log(LogLevel level, fmt::format_string<Args...> format, Args&&... args) {
    log_message(level, fmt::format(format, std::forward<Args>(args)...));
}

}  // namespace clarus
