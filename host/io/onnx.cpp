#include "io/onnx.h"

#include "base/error.h"
#include "base/module.h"
#include "io/file.h"
#include "io/onnx_module.h"

namespace clarus::io {
namespace {

constexpr uintmax_t kLargestFile = uintmax_t{1} << 29;  // twice the weights that a stack of layers may have

const OnnxModule& onnx_module(const std::filesystem::path& path) {
    if (!CLARUS_ONNX)
        fail(
            ErrorKind::invalid_argument,
            "{}: this clarus was built without ONNX: install libonnx-dev and libprotobuf-dev, and build it again, with "
            "CLARUS_ONNX",
            path.string());
    try {
        static const OnnxModule& module = module_function<const OnnxModule&()>("clarus_onnx", "clarus_onnx")();
        return module;
    } catch (const Error& error) {
        fail(ErrorKind::invalid_argument,
             "{}: this program has no part that reads ONNX; `clarus model {} --output FILE.safetensors` makes a model "
             "file of it, which is read everywhere ({})",
             path.string(), path.string(), error.what());
    }
}

}  // namespace

bool is_onnx(const std::filesystem::path& path) { return path.extension() == ".onnx"; }

OnnxGraph read_onnx(const std::filesystem::path& path) {
    const std::string bytes = read_file(path, kLargestFile);
    return onnx_module(path).parse(bytes, path);
}

}  // namespace clarus::io
