#include "pipelines/stack/onnx.h"

#include <doctest/doctest.h>

#include <functional>
#include <map>
#include <nlohmann/json.hpp>

#include "clarus/error.h"
#include "onnx_network.h"
#include "pipelines/pipeline.h"

using namespace clarus;
using namespace clarus::test;
using nlohmann::json;

namespace {

json layers_of(const io::Safetensors& model) { return json::parse(model.require_metadata("layers")); }

json layers_of(const OnnxNetwork& network) { return layers_of(pipelines::stack_of(network.graph)); }

/// That the stack's builder takes what was made.
graph::Graph built(const OnnxNetwork& network) {
    const io::Safetensors model = pipelines::stack_of(network.graph);
    return pipelines::build_stack(model, model.require_integer("scale", 1, 8), {16, 16}, {});
}

void refuse(const OnnxNetwork& network, const std::string& message) {
    CAPTURE(message);
    try {
        pipelines::stack_of(network.graph);
        FAIL("it was taken");
    } catch (const Error& error) {
        CHECK(error.kind() == ErrorKind::file);
        CHECK(std::string(error.what()).starts_with("net.onnx: "));
        CHECK_MESSAGE(std::string(error.what()).find(message) != std::string::npos, error.what());
    }
}

/// Three channels in and out, with nodes between "a", an image of 12 channels, and "b", likewise.
OnnxNetwork around(const std::function<void(OnnxNetwork&)>& add, int64_t channels = 12, int64_t after = 12) {
    OnnxNetwork network;
    network.convolution("in", "a", 3, channels, 3);
    add(network);
    network.convolution("b", "out", after, 3, 1).name = std::string("out");
    return network;
}

OnnxNetwork shuffled(const std::function<void(OnnxNetwork&)>& shuffle, int64_t height = -1, int64_t width = -1) {
    OnnxNetwork network(3, height, width);
    network.convolution("in", "a", 3, 12, 3);
    shuffle(network);
    return network;
}

}  // namespace

TEST_CASE("a sequence of ONNX's nodes becomes the stack's layers" * doctest::test_suite("small")) {
    OnnxNetwork network(1);
    network.convolution("in", "a", 1, 8, 5);
    network.add("Relu", {"a"}, {"b"});
    network.convolution("b", "c", 8, 4, 3);
    network.floats("slopes", {4, 1, 1}, {0.1f, 0.2f, 0.3f, 0.4f});
    network.add("PRelu", {"c", "slopes"}, {"d"});
    network.add("DepthToSpace", {"d"}, {"e"}).attributes = {{"blocksize", OnnxNetwork::integer(2)},
                                                            {"mode", OnnxNetwork::text("CRD")}};
    network.add("Identity", {"e"}, {"out"});
    const io::Safetensors model = pipelines::stack_of(network.graph);
    CHECK(layers_of(model) == json::parse(R"([
        {"type": "convolution", "tensor": "a_w", "size": 5}, {"type": "relu"},
        {"type": "convolution", "tensor": "c_w", "size": 3}, {"type": "prelu", "tensor": "slopes"},
        {"type": "depth_to_space", "scale": 2}])"));
    CHECK(model.require_metadata("network_color") == "luma");
    CHECK(model.require_metadata("scale") == "2");
    CHECK(model.tensors().at("a_w.weight").floats() == network.graph.tensors["a_w"].floats);
    CHECK_NOTHROW(built(network));
}

TEST_CASE("depth to space in ONNX's two orders, and written out, are one layer" * doctest::test_suite("small")) {
    const auto depth_to_space = [](const char* mode) {
        return shuffled([&](OnnxNetwork& network) {
            network.add("DepthToSpace", {"a"}, {"out"}).attributes = {{"blocksize", OnnxNetwork::integer(2)},
                                                                      {"mode", OnnxNetwork::text(mode)}};
        });
    };
    const auto reshaped = [](std::vector<int64_t> split, std::vector<int64_t> order, std::vector<int64_t> joined) {
        return shuffled(
            [&](OnnxNetwork& network) {
                network.integers("split", std::move(split)).integers("joined", std::move(joined));
                network.add("Reshape", {"a", "split"}, {"b"});
                network.add("Transpose", {"b"}, {"c"}).attributes["perm"] =
                    OnnxNetwork::integers_attribute(std::move(order));
                network.add("Reshape", {"c", "joined"}, {"out"});
            },
            10, 14);
    };
    const auto weights = [](const OnnxNetwork& network) {
        const io::Safetensors model = pipelines::stack_of(network.graph);
        CHECK(layers_of(model).size() == 2);
        CHECK(layers_of(model)[1] == json{{"type", "depth_to_space"}, {"scale", 2}});
        CHECK_NOTHROW(built(network));
        return model.tensors().at("a_w.weight").floats();
    };
    const std::vector<float> crd = weights(depth_to_space("CRD")), dcr = weights(depth_to_space("DCR"));
    for (int color = 0; color < 3; ++color)
        for (int pixel = 0; pixel < 4; ++pixel)
            for (int i = 0; i < 27; ++i) CHECK(dcr[27 * (4 * color + pixel) + i] == crd[27 * (3 * pixel + color) + i]);
    CHECK(weights(reshaped({-1, 3, 2, 2, 10, 14}, {0, 1, 4, 2, 5, 3}, {-1, 3, 20, 28})) == crd);
    CHECK(weights(reshaped({1, 2, 2, 3, 10, 14}, {0, 3, 4, 1, 5, 2}, {1, 3, 20, 28})) == dcr);
    const char* alone = "Reshape and Transpose are taken as a pixel shuffle alone";
    refuse(reshaped({1, 3, 2, 2, 14, 10}, {0, 1, 4, 2, 5, 3}, {1, 3, 20, 28}), alone);
    refuse(reshaped({1, 3, 2, 2, 10, 14}, {0, 1, 5, 2, 4, 3}, {1, 3, 20, 28}), alone);
    refuse(reshaped({1, 3, 2, 2, 10, 14}, {0, 1, 4, 2, 5, 3}, {1, 3, 28, 20}), alone);
    refuse(reshaped({1, 3, 4, 1, 10, 14}, {0, 1, 4, 2, 5, 3}, {1, 3, 20, 28}), alone);
}

TEST_CASE("depth to space of what is no convolution's is put in order first" * doctest::test_suite("small")) {
    const OnnxNetwork network = shuffled([](OnnxNetwork& each) {
        each.add("Tanh", {"a"}, {"b"});
        each.add("DepthToSpace", {"b"}, {"out"}).attributes["blocksize"] = OnnxNetwork::integer(2);  // DCR
    });
    const io::Safetensors model = pipelines::stack_of(network.graph);
    REQUIRE(layers_of(model).size() == 4);
    const std::vector<float> order = model.tensors().at("layer 2.weight").floats();
    for (int i = 0; i < 12; ++i)
        for (int k = 0; k < 12; ++k) CHECK(order[12 * i + k] == (k == i % 4 * 3 + i / 4 ? 1 : 0));
    CHECK_NOTHROW(built(network));
}

TEST_CASE("kernels of any form become square ones" * doctest::test_suite("small")) {
    const auto kernel = [](std::vector<int64_t> shape, std::vector<int64_t> pads, std::vector<int64_t> dilations,
                           int64_t stride = 1) {
        OnnxNetwork network = around(
            [&](OnnxNetwork& each) {
                each.floats("w", {1, 12, shape[0], shape[1]},
                            std::vector<float>(static_cast<size_t>(12 * shape[0] * shape[1]), 1));
                each.add("Conv", {"a", "w"}, {"c"}).attributes = {
                    {"pads", OnnxNetwork::integers_attribute(std::move(pads))},
                    {"dilations", OnnxNetwork::integers_attribute(std::move(dilations))},
                    {"strides", OnnxNetwork::integers_attribute({stride, stride})}};
                each.add("Resize", {"c", "", "scales"}, {"b"}).attributes["mode"] = OnnxNetwork::text("linear");
                each.floats("scales", {4}, {1, 1, static_cast<float>(stride), static_cast<float>(stride)});
            },
            12, 1);
        CHECK_NOTHROW(built(network));
        const std::vector<float> all = pipelines::stack_of(network.graph).tensors().at("w.weight").floats();
        return std::vector<float>(all.begin(), all.begin() + std::ssize(all) / 12);
    };
    using Taps = std::vector<float>;
    CHECK(kernel({1, 3}, {0, 1, 0, 1}, {1, 1}) == Taps{0, 0, 0, 1, 1, 1, 0, 0, 0});
    CHECK(kernel({3, 1}, {1, 0, 1, 0}, {1, 1}) == Taps{0, 1, 0, 0, 1, 0, 0, 1, 0});
    CHECK(kernel({2, 2}, {0, 0, 1, 1}, {1, 1}) == Taps{0, 0, 0, 0, 1, 1, 0, 1, 1});
    CHECK(kernel({2, 2}, {1, 1, 0, 0}, {1, 1}) == Taps{1, 1, 0, 1, 1, 0, 0, 0, 0});
    CHECK(kernel({2, 2}, {0, 0, 0, 0}, {1, 1}, 2) == Taps{0, 0, 0, 0, 1, 1, 0, 1, 1});
    const Taps dilated = kernel({3, 3}, {2, 2, 2, 2}, {2, 2});
    for (int i = 0; i < 25; ++i) CHECK(dilated[i] == (i / 5 % 2 == 0 && i % 5 % 2 == 0 ? 1 : 0));
}

TEST_CASE("arithmetic with constants goes into the convolution before, else into one of its own" *
          doctest::test_suite("small")) {
    OnnxNetwork network = around([](OnnxNetwork& each) {
        each.floats("half", {}, {0.5f}).floats("more", {1, 12, 1, 1}, std::vector<float>(12, 0.25f));
        each.add("Mul", {"a", "half"}, {"c"});
        each.add("Add", {"more", "c"}, {"b"});
    });
    io::Safetensors model = pipelines::stack_of(network.graph);
    CHECK(layers_of(model).size() == 2);
    CHECK(model.tensors().at("a_w.weight").floats()[1] == 0.5f * network.graph.tensors["a_w"].floats[1]);
    CHECK(model.tensors().at("a_w.bias").floats() == std::vector<float>(12, 0.25f));

    // Read twice: the convolution's own result is wanted, too.
    network = around([](OnnxNetwork& each) {
        each.floats("two", {}, {2});
        each.add("Div", {"a", "two"}, {"c"});
        each.add("Add", {"a", "c"}, {"b"});
    });
    model = pipelines::stack_of(network.graph);
    CHECK(layers_of(model)[1]["groups"] == 12);
    CHECK(layers_of(model)[2] == json{{"type", "add"}, {"with", 0}});
    CHECK(model.tensors().at("layer 1.weight").floats() == std::vector<float>(12, 0.5f));
    CHECK_NOTHROW(built(network));

    network = around([](OnnxNetwork& each) {
        for (const char* name : {"scale", "shift", "mean"}) each.floats(name, {12}, std::vector<float>(12, 3));
        each.floats("variance", {12}, std::vector<float>(12, 4));
        each.add("BatchNormalization", {"a", "scale", "shift", "mean", "variance"}, {"b"}).attributes["epsilon"] =
            OnnxNetwork::number(0);
    });
    CHECK(pipelines::stack_of(network.graph).tensors().at("a_w.bias").floats() == std::vector<float>(12, -1.5f));
    CHECK_NOTHROW(built(network));
}

TEST_CASE("skips, parts of channels and larger images" * doctest::test_suite("small")) {
    OnnxNetwork network = around(
        [](OnnxNetwork& each) {
            each.integers("first", {0}).integers("middle", {4}).integers("end", {INT64_MAX}).integers("axis", {1});
            each.add("Slice", {"a", "first", "middle", "axis"}, {"low"});
            each.add("Slice", {"a", "middle", "end", "axis"}, {"high"});
            each.add("LeakyRelu", {"low"}, {"low2"});
            each.add("Slice", {"a", "end", "end", "axis"}, {"none"});
            each.add("Concat", {"none", "high", "low2", "none", "in"}, {"joined"}).attributes["axis"] =
                OnnxNetwork::integer(1);
            each.add("Split", {"joined"}, {"x", "y", "z"}).attributes = {
                {"axis", OnnxNetwork::integer(1)}, {"split", OnnxNetwork::integers_attribute({5, 5, 5})}};
            each.add("Mul", {"x", "z"}, {"b"});
        },
        12, 5);
    CHECK_NOTHROW(built(network));
    const json layers = layers_of(network);
    CHECK(layers[1] == json{{"type", "slice"}, {"channels", {0, 4}}});
    CHECK(layers[2] == json{{"type", "slice"}, {"channels", {4, 8}}, {"of", 0}});
    CHECK(layers[3] == json{{"type", "prelu"}, {"tensor", "layer 3"}, {"of", 1}});
    CHECK(layers[4] == json{{"type", "concatenate"}, {"with", {3, -1}}, {"of", 2}});
    CHECK(layers[6] == json{{"type", "slice"}, {"channels", {10, 5}}, {"of", 4}});
    CHECK(layers[7] == json{{"type", "multiply"}, {"with", 5}});

    network = OnnxNetwork();
    network.floats("scales", {4}, {1, 1, 3, 3});
    network.add("Resize", {"in", "", "scales"}, {"out"}).attributes["mode"] = OnnxNetwork::text("linear");
    CHECK(layers_of(network) == json::parse(R"([{"type": "upsample", "scale": 3}])"));
    network.graph.nodes.back().attributes = {{"mode", OnnxNetwork::text("nearest")},
                                             {"nearest_mode", OnnxNetwork::text("floor")},
                                             {"coordinate_transformation_mode", OnnxNetwork::text("asymmetric")}};
    CHECK(pipelines::stack_of(network.graph).tensors().at("layer 0.weight").floats() == std::vector<float>(27, 1));
    CHECK_NOTHROW(built(network));
}

TEST_CASE("sizes that exporters compute are computed" * doctest::test_suite("small")) {
    // torch.chunk(x, 2, 1) of a network whose sides are open.
    const OnnxNetwork network = around(
        [](OnnxNetwork& each) {
            each.integers("zero", {0}).integers("one", {1}).integers("two", {2});
            each.add("Shape", {"a"}, {"shape"});
            each.add("Gather", {"shape", "one"}, {"channels"});
            each.add("Add", {"channels", "one"}, {"sum"});
            each.add("Div", {"sum", "two"}, {"half"});
            each.add("Mul", {"half", "two"}, {"all"});
            each.add("Slice", {"a", "zero", "half", "one"}, {"x"});
            each.add("Slice", {"a", "half", "all", "one"}, {"y"});
            each.add("Mul", {"x", "y"}, {"b"});
        },
        12, 6);
    CHECK(layers_of(network)[1] == json{{"type", "slice"}, {"channels", {0, 6}}});
    CHECK(layers_of(network)[2] == json{{"type", "slice"}, {"channels", {6, 6}}, {"of", 0}});
    CHECK_NOTHROW(built(network));
}

TEST_CASE("what nothing reads is no layer; an output that is no last layer is made one" *
          doctest::test_suite("small")) {
    OnnxNetwork network = around([](OnnxNetwork& each) {
        each.add("Gelu", {"a"}, {"unread"});
        each.add("Relu", {"a"}, {"b"});
    });
    CHECK(layers_of(network).size() == 3);
    network = OnnxNetwork();
    network.add("Identity", {"in"}, {"out"});
    CHECK(layers_of(network) == json::parse(R"([{"type": "slice", "channels": [0, 3]}])"));
    CHECK_NOTHROW(built(network));
}

TEST_CASE("an operator that is not taken is named, the first of them, with those that are" *
          doctest::test_suite("small")) {
    const OnnxNetwork network = around([](OnnxNetwork& each) {
        each.add("Relu", {"a"}, {"c"});
        each.add("InstanceNormalization", {"c"}, {"d"});
        each.add("com.example.Magic", {"d"}, {"b"});
    });
    refuse(network, "node InstanceNormalization_2: the operator InstanceNormalization is not taken; these are: Add, ");
    refuse(network, "DepthToSpace, ");
    for (const char* op : {"Pad", "MaxPool", "AveragePool", "GlobalAveragePool", "MatMul", "Gemm", "Erf", "GridSample",
                           "QuantizeLinear", "If", "Loop", "SpaceToDepth", "com.microsoft.Gelu"})
        refuse(around([&](OnnxNetwork& each) { each.add(op, {"a"}, {"b"}); }),
               std::string("the operator ") + op + " is not taken");
}

TEST_CASE("a network of several images, or of other ones, is refused" * doctest::test_suite("small")) {
    const OnnxNetwork good = around([](OnnxNetwork& each) { each.add("Relu", {"a"}, {"b"}); });
    CHECK_NOTHROW(built(good));
    const auto changed = [&](const std::function<void(io::OnnxGraph&)>& change) {
        OnnxNetwork network = good;
        change(network.graph);
        return network;
    };
    using G = io::OnnxGraph;
    refuse(changed([](G& graph) {
               graph.inputs.push_back({"previous", "FLOAT", {}});
           }),
           "it has 2 inputs (in, previous); networks of one image are taken");
    refuse(changed([](G& graph) { graph.inputs.clear(); }), "it has 0 inputs;");
    refuse(changed([](G& graph) { graph.outputs.push_back({"a", "FLOAT", {}}); }), "it has 2 outputs (out, a)");
    refuse(changed([](G& graph) { graph.inputs[0].shape = {1, 4, 8, 8}; }), "its input in has 4 channels; 3 (red");
    refuse(changed([](G& graph) { graph.inputs[0].shape = {1, -1, 8, 8}; }), "has any number of channels");
    refuse(changed([](G& graph) { graph.inputs[0].shape = {2, 3, 8, 8}; }), "is 2 images at once");
    refuse(changed([](G& graph) { graph.inputs[0].shape = {3, 8, 8}; }), "no shape of four extents");
    refuse(changed([](G& graph) { graph.inputs[0].shape.reset(); }), "no shape of four extents");
    refuse(changed([](G& graph) { graph.inputs[0].type = std::string("UINT8"); }), "is of the type UINT8");
    refuse(changed([](G& graph) { graph.inputs[0].shape = {1, 3, 8, 1 << 20}; }), "a side of 1048576 pixels");
    refuse(changed([](G& graph) { graph.outputs[0].name = std::string("z"); }), "its output z is no image");
    refuse(changed([](G& graph) { graph.inputs[0].shape = {1, 1, 8, 8}; }), "its weights are for 3 channels");
    refuse(changed([](G& graph) { graph.outputs[0].name = std::string("b"); }),
           "it makes an image of 12 channels, 1 times as large");
    refuse(changed([](G& graph) { graph.nodes[1].inputs[0] = std::string("nowhere"); }),
           "it reads nowhere, which nothing");
    refuse(changed([](G& graph) { std::swap(graph.nodes[0], graph.nodes[1]); }), "it reads a, which nothing");
    refuse(changed([](G& graph) { graph.nodes.insert(graph.nodes.begin() + 1, graph.nodes[1]); }),
           "its output b is made twice");
    refuse(changed([](G& graph) { graph.tensors["a_w"].floats[5] = INFINITY; }), "has a value of inf");
    refuse(changed([](G& graph) {
               graph.tensors["a_w"].type = std::string("UINT8");
               graph.tensors["a_w"].floats.clear();
           }),
           "must have elements of FLOAT, not 0 of UINT8");
}

TEST_CASE("what a node does that a stack cannot is refused with the node" * doctest::test_suite("small")) {
    const auto with = [](const std::string& op, std::vector<std::string> inputs,
                         std::map<std::string, io::OnnxAttribute> attributes, int64_t opset = 16) {
        OnnxNetwork network = around([&](OnnxNetwork& each) {
            each.weights("w", {12, 12, 3, 3}).floats("rows", {1, 1, 5, 1}, std::vector<float>(5, 1));
            each.floats("scales", {4}, {1, 1, 1.5f, 1.5f}).floats("twice", {4}, {1, 1, 2, 2}).integers("1", {1});
            each.weights("up", {12, 12, 4, 4}).floats("zero", {}, {0});
            each.graph.nodes.reserve(8);
            each.add(op, std::move(inputs), {"b"}).attributes = std::move(attributes);
        });
        network.graph.opset = opset;
        return network;
    };
    const auto list = OnnxNetwork::integers_attribute;
    refuse(with("Conv", {"a", "w"}, {}), "node Conv_1 (Conv): its pads 0 and 0 make of a side of n pixels");
    refuse(with("Conv", {"a", "w"}, {{"pads", list({1, 1, 1})}}), "its pads are 3 numbers; 4");
    refuse(with("Conv", {"a", "w"}, {{"pads", list({1, 1, 1, -1})}}), "its pads has -1");
    refuse(with("Conv", {"a", "w"}, {{"strides", list({2, 1})}}), "its strides are 2 and 1");
    refuse(with("Conv", {"a", "w"}, {{"dilations", list({20, 20})}, {"pads", list({20, 20, 20, 20})}}),
           "its kernel reaches 20 pixels");
    refuse(with("Conv", {"a", "w"}, {{"group", OnnxNetwork::integer(0)}}), "its group is 0");
    refuse(with("Conv", {"a", "w"}, {{"group", OnnxNetwork::text("1")}}), "its attribute group is of another kind");
    refuse(with("Conv", {"a", "in"}, {}), "its input 1 (in) must be a constant");
    refuse(with("Conv", {"a"}, {}), "its input 1 is missing");
    refuse(with("ConvTranspose", {"a", "up"}, {{"strides", list({2, 2})}}), "its output_padding must be -2");
    refuse(with("Resize", {"a", "", "scales"}, {}), "its scales must be 1, 1 and twice a whole number");
    refuse(with("Resize", {"a", "", "twice"}, {{"mode", OnnxNetwork::text("cubic")}}), "the mode cubic by half_pixel");
    refuse(with("Resize", {"a", "", "twice"},
                {{"mode", OnnxNetwork::text("linear")},
                 {"coordinate_transformation_mode", OnnxNetwork::text("align_corners")}}),
           "the mode linear by align_corners");
    refuse(with("Upsample", {"a", "twice"}, {{"mode", OnnxNetwork::text("linear")}}, 9), "linear by asymmetric");
    refuse(with("Add", {"a", "rows"}, {}), "must be one number, or have the shape [12, 1, 1]");
    refuse(with("Add", {"a", "in"}, {}), "it combines images of");
    refuse(with("Sub", {"a", "a"}, {}), "one of its inputs must be a constant");
    refuse(with("Div", {"a", "zero"}, {}), "by a constant other than 0");
    refuse(with("Softmax", {"a"}, {}), "its axis is -1; 1, that of channels");
    refuse(with("Softmax", {"a"}, {{"axis", OnnxNetwork::integer(1)}}, 11), "before opset 13");
    refuse(with("Concat", {"a", "a"}, {{"axis", OnnxNetwork::integer(2)}}), "its axis is 2");
    refuse(with("Slice", {"a", "1", "1", "1"}, {}), "node out (Conv): its input 0 (b) is an image of no channels");
    refuse(with("ReduceMax", {"a"}, {{"axes", list({1})}, {"keepdims", OnnxNetwork::integer(0)}}), "its keepdims is 0");
    refuse(with("DepthToSpace", {"a"}, {{"blocksize", OnnxNetwork::integer(5)}}), "12 channels cannot be made blocks");
    refuse(with("DepthToSpace", {"a"}, {{"blocksize", OnnxNetwork::integer(100)}}), "an image 100 times as large");
    refuse(with("Cast", {"a"}, {{"to", OnnxNetwork::integer(3)}}), "not type 3");
    refuse(with("Dropout", {"a", "zero", "1"}, {}), "a network in training");
}
