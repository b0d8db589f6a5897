#include "api/history.h"

#include <span>

#include "clarus/error.h"

using namespace clarus;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    try {
        const std::string network = "a network";
        bytes_of(history_of(std::as_bytes(std::span(data, size)), network), network);
    } catch (const Error&) {
    }
    return 0;
}
