#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace clarus::io {

enum class DataType { f32, f16, i8, i32 };

struct Tensor {
    DataType type = DataType::f32;
    std::vector<int64_t> shape;
    std::span<const std::byte> bytes;  // little-endian; valid as long as the Safetensors or a copy of it
    std::string name;
    std::filesystem::path file;  // for messages

    int64_t elements() const;
    /// F32 as is, F16 widened. Errors: file where the type is an integer.
    std::vector<float> floats() const;
};

/// A safetensors file, read whole and trusted in nothing: header length, JSON, dtypes, shapes, offsets, overlaps and
/// gaps are checked. Errors: file, naming the file, the tensor and what is wrong. Copies share the bytes.
class Safetensors {
  public:
    static Safetensors read(const std::filesystem::path& path);
    /// The bytes of such a file; `name` stands for its path.
    static Safetensors parse(std::string bytes, const std::filesystem::path& name);

    const std::filesystem::path& path() const { return path_; }
    const std::map<std::string, std::string>& metadata() const { return metadata_; }
    const std::map<std::string, Tensor>& tensors() const { return tensors_; }
    bool has(const std::string& name) const { return tensors_.contains(name); }
    int64_t elements() const;  // of all tensors

    /// A tensor that must be there and have this shape; −1 fits any extent. Errors: file, with name and expectation.
    const Tensor& require(const std::string& name, std::span<const int64_t> shape) const;
    /// A metadata key that must be there. Errors: file, with its name.
    const std::string& require_metadata(const std::string& key) const;
    /// The same, as a whole number in [low, high].
    int require_integer(const std::string& key, int low, int high) const;
    /// The same, as a number in [low, high].
    double require_number(const std::string& key, double low, double high) const;

  private:
    std::filesystem::path path_;
    std::shared_ptr<const std::string> data_;
    std::map<std::string, std::string> metadata_;
    std::map<std::string, Tensor> tensors_;
};

}  // namespace clarus::io
