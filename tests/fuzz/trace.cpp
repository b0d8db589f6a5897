#include "clarus/error.h"
#include "cli/report_traces.h"
#include "input_file.h"

using namespace clarus;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    const std::filesystem::path files[] = {input_file("trace.json", data, size)};
    try {
        cli::timeline_of_traces(files).dump();
    } catch (const Error&) {
    }
    return 0;
}
