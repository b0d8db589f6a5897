#include "measure/bench_file.h"

#include "clarus/error.h"
#include "input_file.h"
#include "measure/comparison.h"

using namespace clarus;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    try {
        const auto path = input_file("bench.json", data, size);
        measure::BenchFile(path).json.dump();
        measure::compare(path, path);
    } catch (const Error&) {
    }
    return 0;
}
