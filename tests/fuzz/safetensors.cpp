#include "io/safetensors.h"

#include "clarus/error.h"
#include "input_file.h"

using namespace clarus;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    try {
        const auto file = io::Safetensors::read(input_file("model.safetensors", data, size));
        for (const auto& [name, tensor] : file.tensors())
            if (tensor.type == io::DataType::f32 || tensor.type == io::DataType::f16) tensor.floats();
    } catch (const Error&) {
    }
    return 0;
}
