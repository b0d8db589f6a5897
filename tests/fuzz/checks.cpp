#include "measure/checks.h"

#include "clarus/error.h"
#include "input_file.h"

using namespace clarus;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    const auto path = input_file("checks.json", data, size);
    try {
        const auto checks = measure::Checks::read(path);
        checks.write(path);
    } catch (const Error&) {
        return 0;
    }
    // What was written is one of these, too.
    measure::Checks::read(path);
    return 0;
}
