#include "io/onnx.h"

#include <doctest/doctest.h>
#include <onnx/onnx_pb.h>

#include <fstream>
#include <functional>
#include <string>

#include "clarus/error.h"
#include "io/file.h"
#include "temporary_folder.h"

using namespace clarus;

namespace {

std::string espcn() { return io::read_file(std::string(CLARUS_GOLDEN_DIR) + "/stack_espcn_x2.onnx"); }

/// A file of these bytes, read; what is wrong with it, if it is refused.
std::string message_of(const std::string& bytes) {
    const TemporaryFolder folder;
    std::ofstream(folder / "net.onnx", std::ios::binary) << bytes;
    try {
        io::read_onnx(folder / "net.onnx");
    } catch (const Error& error) {
        CHECK(error.kind() == ErrorKind::file);
        CHECK(std::string(error.what()).find("net.onnx") != std::string::npos);
        return error.what();
    }
    return "taken";
}

std::string changed(const std::function<void(onnx::ModelProto&)>& change) {
    onnx::ModelProto model;
    REQUIRE(model.ParseFromString(espcn()));
    change(model);
    return message_of(model.SerializeAsString());
}

io::OnnxGraph read(const onnx::ModelProto& model) {
    const TemporaryFolder folder;
    std::ofstream(folder / "net.onnx", std::ios::binary) << model.SerializeAsString();
    return io::read_onnx(folder / "net.onnx");
}

#define CHECK_CONTAINS(text, part) CHECK_MESSAGE((text).find(part) != std::string::npos, text)

}  // namespace

TEST_CASE("a file that PyTorch has written is read" * doctest::test_suite("small")) {
    const io::OnnxGraph graph = io::read_onnx(std::string(CLARUS_GOLDEN_DIR) + "/stack_espcn_x2.onnx");
    CHECK(graph.opset == 16);
    REQUIRE(graph.inputs.size() == 1);
    CHECK(graph.inputs[0].name == "seen");
    CHECK(graph.inputs[0].type == "FLOAT");
    CHECK(graph.inputs[0].shape == std::vector<int64_t>{1, 1, 8, 12});
    REQUIRE(graph.outputs.size() == 1);
    CHECK(graph.outputs[0].name == "image");
    REQUIRE(graph.nodes.size() >= 6);
    CHECK(graph.nodes[0].op == "Conv");
    CHECK(graph.nodes[0].attributes.at("pads").integers == std::vector<int64_t>{2, 2, 2, 2});
    CHECK(graph.nodes[5].op == "DepthToSpace");
    CHECK(graph.nodes[5].attributes.at("mode").text == "CRD");
    const io::OnnxTensor& weights = graph.tensors.at(graph.nodes[0].inputs[1]);
    CHECK(weights.shape == std::vector<int64_t>{22, 1, 5, 5});
    CHECK(weights.floats.size() == 22 * 25);
}

TEST_CASE("every way of writing a tensor's elements is read" * doctest::test_suite("small")) {
    onnx::ModelProto model;
    const auto add = [&](const char* name, onnx::TensorProto::DataType type) {
        onnx::TensorProto& tensor = *model.mutable_graph()->add_initializer();
        tensor.set_name(name);
        tensor.set_data_type(type);
        tensor.add_dims(2);
        return &tensor;
    };
    onnx::TensorProto* tensor = add("f32", onnx::TensorProto::FLOAT);
    tensor->add_float_data(1.5f);
    tensor->add_float_data(-2);
    add("f16 raw", onnx::TensorProto::FLOAT16)->set_raw_data(std::string("\x00\x3c\x00\xc0", 4));
    tensor = add("f16", onnx::TensorProto::FLOAT16);
    tensor->add_int32_data(0x3c00);
    tensor->add_int32_data(0xc000);
    tensor = add("f64", onnx::TensorProto::DOUBLE);
    tensor->add_double_data(0.25);
    tensor->add_double_data(4);
    add("i32", onnx::TensorProto::INT32)->set_raw_data(std::string("\x07\0\0\0\xff\xff\xff\xff", 8));
    tensor = add("i64", onnx::TensorProto::INT64);
    tensor->add_int64_data(-3);
    tensor->add_int64_data(INT64_MAX);
    add("u8", onnx::TensorProto::UINT8)->set_raw_data("ab");
    const io::OnnxGraph graph = read(model);
    CHECK(graph.tensors.at("f32").floats == std::vector<float>{1.5f, -2});
    CHECK(graph.tensors.at("f16 raw").floats == std::vector<float>{1, -2});
    CHECK(graph.tensors.at("f16").floats == std::vector<float>{1, -2});
    CHECK(graph.tensors.at("f64").floats == std::vector<float>{0.25f, 4});
    CHECK(graph.tensors.at("i32").integers == std::vector<int64_t>{7, -1});
    CHECK(graph.tensors.at("i64").integers == std::vector<int64_t>{-3, INT64_MAX});
    CHECK(graph.tensors.at("u8").type == "UINT8");
    CHECK(graph.tensors.at("u8").integers.empty());
}

TEST_CASE("a damaged ONNX file is refused with what is wrong" * doctest::test_suite("small")) {
    const std::string good = espcn();
    CHECK(message_of(good) == "taken");
    CHECK_CONTAINS(message_of(""), "it has no graph");
    CHECK_CONTAINS(message_of("PNG\r\n\x1a\n and more"), "is no ONNX file, or is cut short or damaged");
    for (size_t size = 1; size < good.size(); size += 1 + good.size() / 61)
        CHECK(message_of(good.substr(0, size)) != "taken");
    using M = onnx::ModelProto;
    const auto first = [](M& model) -> onnx::TensorProto& { return *model.mutable_graph()->mutable_initializer(0); };
    CHECK_CONTAINS(changed([&](M& model) { first(model).mutable_raw_data()->pop_back(); }), "bytes where its shape");
    CHECK_CONTAINS(changed([&](M& model) { first(model).clear_raw_data(); }), "has 0 elements where its shape has");
    CHECK_CONTAINS(changed([&](M& model) { first(model).set_dims(0, -1); }), "has the extent -1");
    CHECK_CONTAINS(changed([&](M& model) { first(model).set_dims(0, INT64_MAX); }), "more than 67108864 elements");
    CHECK_CONTAINS(changed([&](M& model) {
                       for (int i = 0; i < 8; ++i) first(model).add_dims(1);
                   }),
                   "has 12 extents; up to 8");
    CHECK_CONTAINS(changed([&](M& model) { first(model).set_data_location(onnx::TensorProto::EXTERNAL); }),
                   "is in another file (external data)");
    CHECK_CONTAINS(changed([&](M& model) { *model.mutable_graph()->add_initializer() = first(model); }),
                   "two initialisers are named");
    CHECK_CONTAINS(changed([](M& model) { model.mutable_graph()->add_sparse_initializer(); }), "sparse initialisers");
    CHECK_CONTAINS(changed([](M& model) {
                       for (int i = 0; i < 5000; ++i) model.mutable_graph()->add_node();
                   }),
                   "nodes; up to 4096 are taken");
}

TEST_CASE("a small ONNX file that would take much memory is refused" * doctest::test_suite("small")) {
    // Four million empty nodes, each two bytes.
    std::string nodes;
    for (int i = 0; i < (4 << 20); ++i) nodes += std::string("\x0a\x00", 2);
    std::string length;
    for (size_t rest = nodes.size(); rest > 0; rest >>= 7)
        length += static_cast<char>((rest & 0x7f) | (rest > 0x7f ? 0x80 : 0));
    CHECK_CONTAINS(message_of("\x3a" + length + nodes), "would take more than");
}

TEST_CASE("inputs that are initialisers are none, and nodes without names have numbers" *
          doctest::test_suite("small")) {
    onnx::ModelProto model;
    REQUIRE(model.ParseFromString(espcn()));
    onnx::GraphProto& graph = *model.mutable_graph();
    graph.add_input()->set_name(graph.initializer(0).name());
    graph.mutable_node(1)->clear_name();
    graph.mutable_node(2)->set_domain("com.example");
    const io::OnnxGraph result = read(model);
    CHECK(result.inputs.size() == 1);
    CHECK(result.nodes[1].name == "number 1");
    CHECK(result.nodes[2].op == "com.example.Conv");
}
