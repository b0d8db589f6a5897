#include "io/onnx.h"

#include "clarus/error.h"
#include "input_file.h"
#include "pipelines/pipeline.h"
#include "pipelines/stack/onnx.h"

using namespace clarus;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    try {
        const io::Safetensors model = pipelines::stack_of(io::read_onnx(input_file("net.onnx", data, size)));
        for (const Size render : {Size{8, 8}, Size{5, 1}})
            pipelines::build_stack(model, model.require_integer("scale", 1, 8), render, {});
    } catch (const Error&) {
    }
    return 0;
}
