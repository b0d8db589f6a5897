#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "io/onnx.h"

namespace clarus::test {

/// A network in ONNX form as a test writes it down: its input is "in", its output "out".
class OnnxNetwork {
  public:
    explicit OnnxNetwork(int64_t channels = 3, int64_t height = -1, int64_t width = -1) {
        graph.path = "net.onnx";
        graph.opset = 16;
        graph.inputs = {{"in", "FLOAT", std::vector<int64_t>{1, channels, height, width}}};
        graph.outputs = {{"out", "FLOAT", {}}};
    }

    io::OnnxNode& add(const std::string& op, std::vector<std::string> inputs, std::vector<std::string> outputs) {
        graph.nodes.push_back(
            {op, op + "_" + std::to_string(graph.nodes.size()), std::move(inputs), std::move(outputs), {}});
        return graph.nodes.back();
    }
    /// Weights that are all different.
    OnnxNetwork& weights(const std::string& name, std::vector<int64_t> shape) {
        size_t count = 1;
        for (const int64_t extent : shape) count *= static_cast<size_t>(extent);
        std::vector<float> values;
        for (size_t i = 0; i < count; ++i) values.push_back(0.01f * static_cast<float>(i % 97) - 0.25f);
        return floats(name, std::move(shape), std::move(values));
    }
    OnnxNetwork& floats(const std::string& name, std::vector<int64_t> shape, std::vector<float> values) {
        graph.tensors[name] = {"FLOAT", std::move(shape), std::move(values), {}};
        return *this;
    }
    OnnxNetwork& integers(const std::string& name, std::vector<int64_t> values) {
        const auto count = static_cast<int64_t>(values.size());
        graph.tensors[name] = {"INT64", {count}, {}, std::move(values)};
        return *this;
    }
    /// A convolution that keeps the image's size, of weights that are added.
    io::OnnxNode& convolution(const std::string& in, const std::string& out, int64_t from, int64_t to, int64_t size) {
        weights(out + "_w", {to, from, size, size});
        io::OnnxNode& node = add("Conv", {in, out + "_w"}, {out});
        node.attributes["pads"] = integers_attribute(std::vector<int64_t>(4, (size - 1) / 2));
        return node;
    }

    static io::OnnxAttribute integers_attribute(std::vector<int64_t> values) {
        io::OnnxAttribute result;
        result.kind = io::OnnxAttribute::Kind::integers;
        result.integers = std::move(values);
        return result;
    }
    static io::OnnxAttribute integer(int64_t value) {
        io::OnnxAttribute result;
        result.kind = io::OnnxAttribute::Kind::integer;
        result.integer = value;
        return result;
    }
    static io::OnnxAttribute number(float value) {
        io::OnnxAttribute result;
        result.kind = io::OnnxAttribute::Kind::number;
        result.number = value;
        return result;
    }
    static io::OnnxAttribute text(std::string value) {
        io::OnnxAttribute result;
        result.kind = io::OnnxAttribute::Kind::text;
        result.text = std::move(value);
        return result;
    }

    io::OnnxGraph graph;
};

}  // namespace clarus::test
