#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "io/safetensors.h"

namespace clarus::io {

/// A tensor to be written.
struct NewTensor {
    DataType type = DataType::f32;
    std::vector<int64_t> shape;
    std::string bytes;  // little-endian

    template <typename Number>
    static NewTensor of(DataType type, std::vector<int64_t> shape, std::span<const Number> values) {
        return {type, std::move(shape), {reinterpret_cast<const char*>(values.data()), values.size_bytes()}};
    }
};

/// A safetensors file: the largest elements first, so that each tensor lies at a multiple of its elements' size.
std::string safetensors_bytes(const std::map<std::string, std::string>& metadata,
                              const std::map<std::string, NewTensor>& tensors);

/// Writes one. Errors: those of write_file_atomically.
void write_safetensors(const std::filesystem::path& path, const std::map<std::string, std::string>& metadata,
                       const std::map<std::string, NewTensor>& tensors);

}  // namespace clarus::io
