#include "clarus/error.h"
#include "cli/run_file.h"
#include "input_file.h"

using namespace clarus;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    try {
        cli::read_run(input_file("report.json", data, size).parent_path()).dump();
    } catch (const Error&) {
    }
    return 0;
}
