#pragma once

#include <functional>
#include <string_view>

#include "clarus/export.h"

namespace clarus {

enum class LogLevel { debug, info, warning };

using LogCallback = std::function<void(LogLevel, std::string_view message)>;

/// Where Clarus reports what it does (kernels compiled, tuning, fallbacks taken) and what looks wrong without being an
/// error. One callback for the process; none (silence) until set. May be called from any thread, never concurrently.
/// What it throws is dropped. It may set another callback; of what it does else with Clarus it hears nothing, and
/// it must not wait for another thread that uses Clarus, as opening a device may.
CLARUS_API void set_log_callback(LogCallback callback);

}  // namespace clarus
