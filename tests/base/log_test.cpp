#include "base/log.h"

#include <doctest/doctest.h>

#include <string>

using namespace clarus;

TEST_CASE("a log's callback may set another, and what it logs itself is dropped") {
    std::string heard;
    set_log_callback([&](LogLevel, std::string_view message) {
        heard += message;
        log(LogLevel::info, "dropped");
        set_log_callback([&](LogLevel, std::string_view next) { heard += std::string("; then ") + std::string(next); });
        heard += "!";  // what it lives on in is still there
    });
    log(LogLevel::info, "one");
    log(LogLevel::info, "two");
    set_log_callback({});
    log(LogLevel::info, "three");
    CHECK(heard == "one!; then two");
}
