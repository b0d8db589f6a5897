#include "link/address.h"

#include "clarus/error.h"

using namespace clarus;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    const std::string text(reinterpret_cast<const char*>(data), size);
    try {
        const auto address = link::parse_address(text, "--listen");
        // What is said to the user leads to the same place.
        const auto again = link::parse_address(address.text(), "--listen");
        if (again.host != address.host || again.port != address.port) __builtin_trap();
    } catch (const Error&) {
    }
    try {
        link::parse_remote_stream(text, "--share");
    } catch (const Error&) {
    }
    return 0;
}
