#include "io/sequence.h"

#include "clarus/error.h"
#include "input_file.h"

using namespace clarus;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    const auto path = input_file("sequence.json", data, size);
    for (const auto layout : {io::Layout::native, io::Layout::nss}) {
        try {
            const auto sequence = io::read_sequence(path, layout);
            sequence.output_size();
            sequence.motion_encoding();
            for (const auto& frame : sequence.frames) sequence.motion_scale(frame);
        } catch (const Error&) {
        }
    }
    return 0;
}
