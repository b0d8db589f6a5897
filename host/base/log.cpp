#include "base/log.h"

#include <memory>
#include <mutex>

namespace clarus {
namespace {

// A callback may set another, from within.
std::recursive_mutex& mutex() {
    static std::recursive_mutex instance;
    return instance;
}

using Callback = std::shared_ptr<const LogCallback>;

Callback& callback() {
    static Callback instance;
    return instance;
}

}  // namespace

void set_log_callback(LogCallback new_callback) {
    Callback next = new_callback ? std::make_shared<const LogCallback>(std::move(new_callback)) : nullptr;
    const std::lock_guard lock(mutex());
    callback().swap(next);
}

void log_message(LogLevel level, std::string_view message) {
    thread_local bool is_in_callback = false;
    const std::lock_guard lock(mutex());
    const Callback current = callback();  // lives on where it sets another
    if (!current || is_in_callback) return;
    is_in_callback = true;
    try {
        (*current)(level, message);
    } catch (...) {
        // Lines come from destructors, too: what becomes of one is no reason to end the process.
    }
    is_in_callback = false;
}

}  // namespace clarus
