#pragma once

#include <fmt/format.h>

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/error.h"
#include "io/onnx.h"

namespace clarus::pipelines {

/// A node of an ONNX network that is being read, for its attributes and for complaints that name it. Refers to both.
class OnnxNodeReader {
  public:
    OnnxNodeReader(const io::OnnxGraph& network, const io::OnnxNode& node) : network_(&network), node_(&node) {}

    const io::OnnxNode* operator->() const { return node_; }
    int64_t opset() const { return network_->opset; }

    /// Errors: file, naming file, node and operator.
    template <typename... Args>
    [[noreturn]] void refuse(fmt::format_string<Args...> format, Args&&... args) const {
        fail(ErrorKind::file, "{}: node {} ({}): {}", network_->path.string(), node_->name, node_->op,
             fmt::format(format, std::forward<Args>(args)...));
    }

    bool has_input(size_t i) const { return i < node_->inputs.size() && !node_->inputs[i].empty(); }
    /// A name of a value. Errors: file where the node has no such input.
    const std::string& input(size_t i) const {
        if (!has_input(i)) refuse("its input {} is missing", i);
        return node_->inputs[i];
    }

    // Attributes, or else what their default is. Errors: file for one of another kind.
    int64_t integer(const char* name, int64_t otherwise) const {
        const io::OnnxAttribute* found = find(name, io::OnnxAttribute::Kind::integer);
        return found ? found->integer : otherwise;
    }
    float number(const char* name, float otherwise) const {
        const io::OnnxAttribute* found = find(name, io::OnnxAttribute::Kind::number);
        return found ? found->number : otherwise;
    }
    std::string text(const char* name, const char* otherwise) const {
        const io::OnnxAttribute* found = find(name, io::OnnxAttribute::Kind::text);
        return found ? found->text : otherwise;
    }
    std::optional<std::vector<int64_t>> integers(const char* name) const {
        const io::OnnxAttribute* found = find(name, io::OnnxAttribute::Kind::integers);
        return found ? std::optional(found->integers) : std::nullopt;
    }
    std::optional<std::vector<float>> numbers(const char* name) const {
        const io::OnnxAttribute* found = find(name, io::OnnxAttribute::Kind::numbers);
        return found ? std::optional(found->numbers) : std::nullopt;
    }
    const io::OnnxTensor* tensor(const char* name) const {
        const io::OnnxAttribute* found = find(name, io::OnnxAttribute::Kind::tensor);
        return found ? &found->tensor : nullptr;
    }

    /// One that must have this value where it is given.
    void expect(const char* name, int64_t value) const {
        if (const int64_t is = integer(name, value); is != value)
            refuse("its {} is {}; only {} is taken", name, is, value);
    }

  private:
    const io::OnnxAttribute* find(const char* name, io::OnnxAttribute::Kind kind) const {
        const auto found = node_->attributes.find(name);
        if (found == node_->attributes.end()) return nullptr;
        if (found->second.kind != kind) refuse("its attribute {} is of another kind", name);
        return &found->second;
    }

    const io::OnnxGraph* network_;
    const io::OnnxNode* node_;
};

}  // namespace clarus::pipelines
