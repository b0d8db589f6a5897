#include "measure/bench_file.h"

#include "clarus/error.h"
#include "input_file.h"

using namespace clarus;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    try {
        measure::BenchFile(input_file("bench.json", data, size)).json.dump();
    } catch (const Error&) {
    }
    return 0;
}
