#include "io/safetensors_writer.h"

#include <nlohmann/json.hpp>

#include "io/file.h"

namespace clarus::io {
namespace {

struct Type {
    DataType type;
    const char* name;
};
constexpr Type kTypes[] = {
    {DataType::f32, "F32"}, {DataType::i32, "I32"}, {DataType::f16, "F16"}, {DataType::i8, "I8"}};

}  // namespace

std::string safetensors_bytes(const std::map<std::string, std::string>& metadata,
                              const std::map<std::string, NewTensor>& tensors) {
    nlohmann::ordered_json header;
    header["__metadata__"] = metadata;
    std::string body;
    for (const Type& type : kTypes) {
        for (const auto& [name, tensor] : tensors) {
            if (tensor.type != type.type) continue;
            header[name] = {{"dtype", type.name},
                            {"shape", tensor.shape},
                            {"data_offsets", {body.size(), body.size() + tensor.bytes.size()}}};
            body += tensor.bytes;
        }
    }
    std::string text = header.dump();
    constexpr size_t kAlignment = 8;
    text.resize((text.size() + kAlignment - 1) / kAlignment * kAlignment, ' ');
    const uint64_t size = text.size();
    return std::string(reinterpret_cast<const char*>(&size), sizeof size) + text + body;
}

void write_safetensors(const std::filesystem::path& path, const std::map<std::string, std::string>& metadata,
                       const std::map<std::string, NewTensor>& tensors) {
    const std::string bytes = safetensors_bytes(metadata, tensors);
    write_file_atomically(path, std::as_bytes(std::span(bytes)));
}

}  // namespace clarus::io
