#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace clarus::io {

/// Values of a network in ONNX form that are known before it runs: weights, sizes.
struct OnnxTensor {
    std::string type;  // of its elements, as messages call it: "FLOAT"
    std::vector<int64_t> shape;
    // One of these has the elements: of types that are neither kind, none has.
    std::vector<float> floats;
    std::vector<int64_t> integers;
};

/// Of an attribute the member is filled in that its kind says.
struct OnnxAttribute {
    enum class Kind { number, integer, text, numbers, integers, tensor, other } kind = Kind::other;
    float number = 0;
    int64_t integer = 0;
    std::string text;
    std::vector<float> numbers;
    std::vector<int64_t> integers;
    OnnxTensor tensor;
};

struct OnnxNode {
    std::string op;                            // "Conv"; of a domain of its own "com.microsoft.Gelu"
    std::string name;                          // as messages call it; a node without a name is called by its number
    std::vector<std::string> inputs, outputs;  // names of values; an input that is left out is empty
    std::map<std::string, OnnxAttribute> attributes;
};

/// What goes into the network or comes out.
struct OnnxPort {
    std::string name;
    std::string type;                           // of its elements: "FLOAT"
    std::optional<std::vector<int64_t>> shape;  // −1 where any extent will do; none where the file does not say
};

/// An ONNX file's network as plain data.
struct OnnxGraph {
    std::filesystem::path path;  // for messages
    int64_t opset = 0;           // the version of the operators
    std::vector<OnnxNode> nodes;
    std::map<std::string, OnnxTensor> tensors;  // its initialisers, by name
    std::vector<OnnxPort> inputs;               // those that are no initialisers
    std::vector<OnnxPort> outputs;
};

bool is_onnx(const std::filesystem::path& path);

/// Reads an ONNX file and trusts nothing in it: sizes, counts and shapes have limits (docs/formats.md, "ONNX
/// networks"), and reading takes at most a few times the file's size. Whether the nodes make a network that can run is
/// for the caller to see. Errors: file, naming the file and what is wrong in it; invalid_argument where this build, or
/// the program that the library is in, lacks the module that reads ONNX, with the way out.
OnnxGraph read_onnx(const std::filesystem::path& path);

}  // namespace clarus::io
