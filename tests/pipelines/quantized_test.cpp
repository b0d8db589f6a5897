#include <doctest/doctest.h>

#include <cstring>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "clarus/error.h"
#include "clarus/model.h"
#include "graph/passes.h"
#include "io/safetensors.h"
#include "model_file.h"
#include "pipelines/pipeline.h"
#include "temporary_folder.h"

using namespace clarus;

namespace {

const std::string kStack = CLARUS_GOLDEN_DIR "/stack_int8_x2.model.safetensors";

/// The model's tensors one by one, to be changed.
class Tensors {
  public:
    explicit Tensors(const std::string& path) {
        const ModelFile file = ModelFile::read(path);
        for (const auto& [name, entry] : file.header.items()) {
            if (name == "__metadata__") continue;
            const size_t begin = entry["data_offsets"][0], end = entry["data_offsets"][1];
            all_[name] = {entry["dtype"], entry["shape"], file.body.substr(begin, end - begin)};
        }
        metadata_ = file.header["__metadata__"];
    }

    void erase(const std::string& name) { REQUIRE(all_.erase(name) == 1); }
    void type(const std::string& name, const std::string& type) { all_.at(name).type = type; }
    template <typename Number>
    void put(const std::string& name, size_t index, Number value) {
        std::memcpy(&all_.at(name).bytes.at(index * sizeof value), &value, sizeof value);
    }
    void fill(const std::string& name, char byte) {
        for (char& each : all_.at(name).bytes) each = byte;
    }

    Model load(const TemporaryFolder& folder) const {
        ModelFile file;
        file.header["__metadata__"] = metadata_;
        for (const auto& [name, tensor] : all_) file.add(name, tensor.type, tensor.shape, tensor.bytes);
        file.write(folder / "changed.safetensors");
        return Model::load((folder / "changed.safetensors").string());
    }

  private:
    struct Content {
        std::string type;
        std::vector<int64_t> shape;
        std::string bytes;
    };
    std::map<std::string, Content> all_;
    nlohmann::json metadata_;
};

graph::Graph graph_of(const std::string& path) {
    const Model model = Model::load(path);
    for (const pipelines::Pipeline& pipeline : pipelines::pipelines())
        if (pipeline.name == model.pipeline()) return pipeline.build(*model.tensors(), model.scale(), {8, 8}, {});
    throw std::logic_error("a model of no pipeline");
}

}  // namespace

TEST_SUITE("small") {
    TEST_CASE("a quantized file that cannot be computed with is refused by the tensor's or the layer's name") {
        const TemporaryFolder folder;
        const auto refuse = [&](const std::string& message, const std::function<void(Tensors&)>& change) {
            Tensors tensors(kStack);
            change(tensors);
            CHECK_THROWS_WITH_AS(tensors.load(folder), doctest::Contains(message.c_str()), Error);
        };
        CHECK_NOTHROW(Tensors(kStack).load(folder));
        for (const char* tensor : {"a.weight_scale", "b.input_scale", "c.input_zero_point", "e.bias"})
            refuse(std::string("lacks the tensor ") + tensor, [&](Tensors& tensors) { tensors.erase(tensor); });
        constexpr float kNaN = std::numeric_limits<float>::quiet_NaN(),
                        kInfinity = std::numeric_limits<float>::infinity();
        for (const float scale : {0.0f, -1.0f, kNaN, kInfinity, 1e-42f}) {
            refuse("tensor b.weight_scale holds the scale", [&](Tensors& all) { all.put("b.weight_scale", 3, scale); });
            refuse("tensor d.input_scale holds the scale", [&](Tensors& all) { all.put("d.input_scale", 0, scale); });
        }
        for (const int32_t zero_point : {-1, 256})
            refuse("tensor c.input_zero_point holds " + std::to_string(zero_point),
                   [&](Tensors& all) { all.put("c.input_zero_point", 0, zero_point); });
        refuse("tensor a.weight holds -128", [](Tensors& all) { all.put<int8_t>("a.weight", 7, -128); });
        refuse("layer a can overflow: sums for its output channel 2",
               [](Tensors& all) { all.put("a.bias", 2, std::numeric_limits<int32_t>::max()); });
        refuse("layer a: the multiplier of output channel 4 overflows",
               [](Tensors& all) { all.put("a.weight_scale", 4, 1e3f); });
        refuse("tensor a.bias of a quantized layer must be of the type I32",
               [](Tensors& all) { all.type("a.bias", "F32"); });
        refuse("tensor e.input_scale holds whole numbers", [](Tensors& all) { all.type("e.input_scale", "I32"); });
    }

    TEST_CASE("quantized layers hand on bytes where quantized layers alone read them") {
        const graph::Graph graph = graph::hand_on_bytes(graph_of(kStack));
        std::map<std::string, bool> hands_on;
        for (const graph::Node& node : graph.nodes)
            if (const auto* convolution = std::get_if<graph::Convolution>(&node.op))
                hands_on[graph.parameters[convolution->parameters]->layer] = convolution->result.has_value();
        // d's result goes from depth to space, f's is the output.
        const std::map<std::string, bool> expected{{"a", true},  {"b", true}, {"c", true},
                                                   {"d", false}, {"e", true}, {"f", false}};
        CHECK(hands_on == expected);
    }

    TEST_CASE("what is looked at, and what others read as well, is not handed on as bytes") {
        graph::Graph graph = graph_of(kStack);
        graph::Value first = -1;
        for (graph::Value value = 0; first < 0; ++value)
            if (std::holds_alternative<graph::Convolution>(graph.nodes[value].op)) first = value;
        const auto hands_on = [&](const graph::Graph& of) {
            return std::get<graph::Convolution>(graph::hand_on_bytes(of).nodes[first].op).result.has_value();
        };
        CHECK(hands_on(graph));
        graph::Graph viewed = graph;
        viewed.views["first"] = first;
        CHECK_FALSE(hands_on(viewed));
        graph::Graph read = graph;
        read.views["clamped"] = read.clamp(first, 0, 1, "clamp");
        CHECK_FALSE(hands_on(read));
    }
}
