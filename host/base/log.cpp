#include "base/log.h"

#include <mutex>

namespace clarus {
namespace {

std::mutex& mutex() {
    static std::mutex instance;
    return instance;
}

LogCallback& callback() {
    static LogCallback instance;
    return instance;
}

}  // namespace

void set_log_callback(LogCallback new_callback) {
    const std::lock_guard lock(mutex());
    callback() = std::move(new_callback);
}

void log_message(LogLevel level, std::string_view message) {
    const std::lock_guard lock(mutex());
    try {
        if (callback()) callback()(level, message);
    } catch (...) {
        // Lines come from destructors, too: what becomes of one is no reason to end the process.
    }
}

}  // namespace clarus
