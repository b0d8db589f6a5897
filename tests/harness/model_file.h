#pragma once

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "io/file.h"

/// A model file in parts, to be put together anew or damaged: what its header says, and its tensors' bytes.
struct ModelFile {
    nlohmann::json header = nlohmann::json::object();
    std::string body;

    static ModelFile read(const std::filesystem::path& path) {
        const std::string bytes = clarus::io::read_file(path);
        uint64_t length = 0;
        std::memcpy(&length, bytes.data(), sizeof length);
        return {nlohmann::json::parse(bytes.substr(8, length)), bytes.substr(8 + length)};
    }

    std::string bytes() const {
        const std::string text = header.dump();
        const uint64_t length = text.size();
        return std::string(reinterpret_cast<const char*>(&length), sizeof length) + text + body;
    }
    void write(const std::filesystem::path& path) const { std::ofstream(path, std::ios::binary) << bytes(); }

    void add(const std::string& name, const std::string& type, const std::vector<int64_t>& shape,
             const std::string& values) {
        header[name] = {
            {"dtype", type}, {"shape", shape}, {"data_offsets", {body.size(), body.size() + values.size()}}};
        body += values;
    }
    void add(const std::string& name, const std::vector<int64_t>& shape, const std::vector<float>& values) {
        add(name, "F32", shape, {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(float)});
    }

    /// The other's metadata and its tensors whose names begin so.
    void take(const ModelFile& other, const std::string& prefix) {
        header["__metadata__"] = other.header["__metadata__"];
        for (const auto& [name, tensor] : other.header.items()) {
            if (!name.starts_with(prefix) || name == "__metadata__") continue;
            const size_t begin = tensor["data_offsets"][0], end = tensor["data_offsets"][1];
            add(name, tensor["dtype"], tensor["shape"], other.body.substr(begin, end - begin));
        }
    }

    /// The model with the first entry of its table alone.
    ModelFile with_single_entry() const {
        ModelFile single;
        single.take(*this, "body.");
        for (const char* name : {"jitter", "first.weight", "first.bias", "last.weight", "last.bias"}) {
            std::vector<int64_t> shape = header[name]["shape"];
            const size_t begin = header[name]["data_offsets"][0], end = header[name]["data_offsets"][1];
            const std::string first = body.substr(begin, (end - begin) / shape[0]);
            shape[0] = 1;
            single.add(name, header[name]["dtype"], shape, first);
        }
        return single;
    }
};
