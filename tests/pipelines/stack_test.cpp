#include <doctest/doctest.h>

#include <functional>
#include <string>

#include "clarus/error.h"
#include "golden.h"
#include "model_file.h"
#include "temporary_folder.h"
#include "test_device.h"

using namespace clarus;
using namespace clarus::test;
using nlohmann::json;

namespace {

constexpr double kTolerance = 2e-5;  // float against double

std::string model_path(const std::string& name) {
    return std::string(CLARUS_GOLDEN_DIR) + "/" + name + ".model.safetensors";
}

/// The model of every kind of layer, its list of layers changed.
Model changed(const TemporaryFolder& folder, const std::function<void(json&)>& change) {
    ModelFile file = ModelFile::read(model_path("stack_all_x2"));
    json layers = json::parse(file.header["__metadata__"]["layers"].get<std::string>());
    change(layers);
    file.header["__metadata__"]["layers"] = layers.dump();
    file.write(folder / "changed.safetensors");
    return Model::load((folder / "changed.safetensors").string());
}

}  // namespace

TEST_CASE("stacks of layers agree with PyTorch" * doctest::test_suite("golden")) {
    for (const char* name :
         {"stack_espcn_x2", "stack_espcn_rgb_x3", "stack_fsrcnn_x3", "stack_esr_max_x2", "stack_esr_tm_x2",
          "stack_esr_tr_x3", "stack_all_x2", "stack_1x1", "stack_espcn_x2_held", "stack_joined_x2"}) {
        CAPTURE(name);
        const Run result = run(Golden(name));
        for (const double difference : result.differences) CHECK(difference < kTolerance);
    }
}

TEST_CASE("a stack on the smallest image agrees with PyTorch" * doctest::test_suite("small")) {
    const Run result = run(Golden("stack_1x1"));
    for (const double difference : result.differences) CHECK(difference < kTolerance);
}

TEST_CASE("stacks in whole numbers are PyTorch's, bit for bit" * doctest::test_suite("golden")) {
    for (const char* name : {"stack_int8_x2", "stack_int8_1x1"}) {
        CAPTURE(name);
        for (const Tuning tuning : {Tuning::stored, Tuning::obvious}) {
            UpscalerOptions options;
            options.tuning = tuning;
            for (const double difference : run(Golden(name), options).differences) CHECK(difference == 0);
        }
    }
}

TEST_CASE("a stack in whole numbers on the smallest image is PyTorch's" * doctest::test_suite("small")) {
    for (const double difference : run(Golden("stack_int8_1x1")).differences) CHECK(difference == 0);
}

TEST_CASE("stacks in half storage stay near" * doctest::test_suite("golden")) {
    UpscalerOptions options;
    options.precision = Precision::fp16;
    for (const char* name : {"stack_fsrcnn_x3", "stack_esr_tr_x3"})
        for (const double difference : run(Golden(name), options).differences) CHECK(difference < 0.02);
}

TEST_CASE("stacks with products of bfloat16 stay near; devices without them compute in float" *
          doctest::test_suite("golden")) {
    UpscalerOptions options;
    options.precision = Precision::bf16;
    const bool rounds = test_device().profile().bf16;
    for (const double difference : run(Golden("stack_fsrcnn_x3"), options).differences) {
        CHECK(difference < (rounds ? 0.02 : kTolerance));
        CHECK((difference > kTolerance) == rounds);
    }
}

TEST_CASE("a stack needs no depth or motion, and its 3x3 convolutions are the fast ones" *
          doctest::test_suite("golden")) {
    const Golden golden("stack_espcn_x2");
    UpscalerOptions options;
    options.profile = true;
    Run result = run(golden, options, 1);
    CHECK_FALSE(result.upscaler.needs_depth());
    CHECK_FALSE(result.upscaler.needs_motion());
    const DeviceProfile profile = test_device().profile();
    for (const StageProfile& stage : result.upscaler.take_profile())
        if (stage.name.starts_with("convolution") && profile.local_memory > (1u << 16))
            CHECK_FALSE(stage.kernel.starts_with("plain"));
}

TEST_CASE("a stack whose strides do not divide the image is refused with the sides it takes" *
          doctest::test_suite("small")) {
    const Model model = Model::load(model_path("stack_all_x2"));
    CHECK_NOTHROW(Upscaler(test_device(), model, {6, 4}));
    CHECK_THROWS_WITH_AS(Upscaler(test_device(), model, {7, 4}), doctest::Contains("multiples of 2, not 7x4"), Error);
}

TEST_CASE("a stack that would take hours a frame is refused, the longest list is planned" *
          doctest::test_suite("small")) {
    ModelFile file;
    file.header["__metadata__"] = {{"pipeline", "stack"}, {"scale", "1"}};
    const auto write = [&](const TemporaryFolder& folder, const json& layers) {
        file.header["__metadata__"]["layers"] = layers.dump();
        file.write(folder / "absurd.safetensors");
        return Model::load((folder / "absurd.safetensors").string());
    };
    const TemporaryFolder folder;
    const auto convolution = [](const char* tensor) {
        return json{{"type", "convolution"}, {"tensor", tensor}, {"size", 1}};
    };
    file.add("wide.weight", {48, 3, 1, 1}, std::vector<float>(48 * 3));
    file.add("body.weight", {48, 48, 1, 1}, std::vector<float>(48 * 48));
    file.add("narrow.weight", {3, 48, 1, 1}, std::vector<float>(3 * 48));
    file.add("large.weight", {4096, 48, 1, 1}, std::vector<float>(4096 * 48));
    file.add("largest.weight", {4096, 4096, 1, 1}, std::vector<float>(4096 * 4096));
    json layers{convolution("wide")};
    for (int i = 0; i < 1022; ++i) layers.push_back(convolution("body"));
    layers.push_back(convolution("narrow"));
    const Model deep = write(folder, layers);
    CHECK_NOTHROW(Upscaler(test_device(), deep, {8, 8}));
    CHECK_THROWS_WITH_AS(Upscaler(test_device(), deep, {16384, 16384}),
                         doctest::Contains("operations a frame, more than the 1e+14 that are allowed"), Error);
    json broad{convolution("wide"), convolution("large"), {{"type", "tanh"}}, convolution("small")};
    file.add("small.weight", {3, 4096, 1, 1}, std::vector<float>(3 * 4096));
    CHECK_THROWS_WITH_AS(Upscaler(test_device(), write(folder, broad), {8, 8}),
                         doctest::Contains("4096 channels between two convolutions"), Error);
    // The same tensor again and again: a small file, much memory.
    json wide{convolution("wide"), convolution("large")};
    for (int i = 0; i < 4; ++i) wide.push_back(convolution("largest"));
    CHECK_THROWS_WITH_AS(write(folder, wide), doctest::Contains("have more than 67108864 weights"), Error);
}

TEST_CASE("a list of layers that means nothing is refused with the place" * doctest::test_suite("small")) {
    const TemporaryFolder folder;
    const auto refuse = [&](const std::string& message, const std::function<void(json&)>& change) {
        CHECK_THROWS_WITH_AS(changed(folder, change), doctest::Contains(message.c_str()), Error);
    };
    CHECK_NOTHROW(changed(folder, [](json&) {}));
    refuse("\"layers\": the top level must be a list", [](json& layers) { layers = json::object(); });
    refuse("[0].type must be one of convolution, transposed_convolution",
           [](json& layers) { layers[0]["type"] = "konvolution"; });
    refuse("[0] lacks the field \"type\"", [](json& layers) { layers[0].erase("type"); });
    refuse("[3] must be an object", [](json& layers) { layers[3] = 7; });
    refuse("[0] lacks the field \"tensor\"", [](json& layers) { layers[0].erase("tensor"); });
    refuse("lacks the tensor z.weight", [](json& layers) { layers[0]["tensor"] = "z"; });
    refuse("[0] lacks the field \"size\"", [](json& layers) { layers[0].erase("size"); });
    refuse("[0].size must be odd", [](json& layers) { layers[0]["size"] = 4; });
    refuse("tensor a.weight has the shape", [](json& layers) { layers[0]["size"] = 5; });
    refuse("[0].stride must be a whole number from 1", [](json& layers) { layers[0]["stride"] = 0; });
    refuse("[0].stride must be one by which", [](json& layers) { layers[0]["stride"] = 3; });
    refuse("[0].step must be left out; a layer of this type has the fields type, of, tensor, size, stride, groups",
           [](json& layers) { layers[0]["step"] = 2; });
    refuse("[2].groups must be a divisor of the 8 channels", [](json& layers) { layers[2]["groups"] = 3; });
    refuse("[4].channels must be a list of 2", [](json& layers) { layers[4]["channels"] = 3; });
    refuse("[4].channels[1] must be a whole number from 1 to 9", [](json& layers) { layers[4]["channels"] = {3, 10}; });
    refuse("layer 6 does not make images 2 times as large", [](json& layers) { layers[6]["padding"] = 0; });
    refuse("tensor c.weight has the shape", [](json& layers) { layers[7]["tensor"] = "c"; });
    refuse("layer 9 is the product of halves, of 3 channels", [](json& layers) { layers[9]["channels"] = {0, 3}; });
    refuse("[11].scale must be one whose square divides the 48 channels",
           [](json& layers) { layers[11]["scale"] = 3; });
    refuse("[12].groups must be a divisor of the 12 channels", [](json& layers) { layers[12]["groups"] = 5; });
    refuse("layer 13 adds the 3 channels", [](json& layers) { layers.erase(13); });
    refuse("[14].filter must be one of", [](json& layers) { layers[14]["filter"] = "fsr1"; });
    refuse("[4].of must be a whole number from -1 to 3", [](json& layers) { layers[4]["of"] = 4; });
    refuse("[4].with must be a whole number from -1 to 3", [](json& layers) {
        layers[4] = {{"type", "add"}, {"with", 7}};
    });
    refuse("[4].with must be a list", [](json& layers) { layers[4] = {{"type", "concatenate"}, {"with", 0}}; });
    refuse("[4].with must be a layer of 12 channels, or of one; it has 8", [](json& layers) {
        layers[4] = {{"type", "multiply"}, {"with", 0}};
    });
    refuse("[4].with must be a layer whose image is as large as this one, 1/2 of the input's size; it is 1/1 of it",
           [](json& layers) {
               layers[4] = {{"type", "add"}, {"with", -1}};
           });
    refuse("[4].with[340] must be one that makes no more than 4096 channels in all", [](json& layers) {
        layers[4] = {{"type", "concatenate"}, {"with", json(2000, 3)}};
    });
    refuse("[4].high must be a number from 1 to", [](json& layers) {
        layers[4] = {{"type", "clamp"}, {"low", 1}, {"high", 0}};
    });
    refuse("must be a list of at most 1024 layers", [](json& layers) { layers = json(1025, {{"type", "tanh"}}); });
    refuse("the last layer leaves 6 channels of 4/2", [](json& layers) {
        layers.erase(14);
        layers.erase(13);
    });
    refuse("the last layer leaves 3 channels of 4/1", [](json& layers) {
        layers[0]["stride"] = 1;
        layers.erase(14);
    });

    ModelFile file = ModelFile::read(model_path("stack_all_x2"));
    const auto refuse_metadata = [&](const std::string& message, const std::string& key, const std::string& value) {
        ModelFile spoilt = file;
        spoilt.header["__metadata__"][key] = value;
        spoilt.write(folder / "spoilt.safetensors");
        CHECK_THROWS_WITH_AS(Model::load((folder / "spoilt.safetensors").string()), doctest::Contains(message.c_str()),
                             Error);
    };
    refuse_metadata("\"layers\" is not valid JSON", "layers", "[{]");
    refuse_metadata("\"network_color\" must be rgb or luma, not \"xyz\"", "network_color", "xyz");
    refuse_metadata("of 4/2 of the input's size; 3 of 3", "scale", "3");
    file.header["__metadata__"].erase("layers");
    file.write(folder / "spoilt.safetensors");
    CHECK_THROWS_WITH_AS(Model::load((folder / "spoilt.safetensors").string()), doctest::Contains("\"layers\""), Error);
}
