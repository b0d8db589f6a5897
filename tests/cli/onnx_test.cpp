#include <doctest/doctest.h>

#include <fstream>

#include "clarus/error.h"
#include "golden.h"
#include "io/file.h"
#include "program.h"
#include "temporary_folder.h"
#include "test_device.h"

using namespace clarus;
using namespace clarus::test;

namespace {

std::string golden_file(const std::string& name) { return std::string(CLARUS_GOLDEN_DIR) + "/" + name; }

}  // namespace

TEST_CASE("networks that PyTorch has exported give the stack's pictures, bit for bit" * doctest::test_suite("golden")) {
    for (const char* name : {"stack_espcn_x2", "stack_espcn_rgb_x3", "stack_fsrcnn_x3", "stack_esr_max_x2",
                             "stack_esr_tm_x2", "stack_joined_x2"}) {
        CAPTURE(name);
        Golden golden(name);
        const Run expected = run(golden);
        golden.model = Model::load(golden_file(std::string(name) + ".onnx"));
        CHECK(golden.model.pipeline() == "stack");
        CHECK(golden.model.name() == name);
        const Run result = run(golden);
        for (const double difference : result.differences) CHECK(difference < 2e-5);  // from PyTorch
        CHECK(result.outputs == expected.outputs);
    }
}

TEST_CASE("the command shows a network in ONNX form, writes it as a model file, and says what it does not take") {
    const TemporaryFolder folder;
    const std::string network = golden_file("stack_espcn_x2.onnx"), file = folder / "net.safetensors";
    Program shown(CLARUS_TOOL, {"model", network});
    CHECK(shown.result() == 0);
    CHECK(shown.out().find("pipeline stack, scale 2") != std::string::npos);

    Program written(CLARUS_TOOL, {"model", network, "--output", file});
    CHECK(written.result() == 0);
    const Model one = Model::load(network), other = Model::load(file);
    CHECK(one.metadata() == other.metadata());
    REQUIRE(one.tensors()->tensors().size() == other.tensors()->tensors().size());
    for (const auto& [name, tensor] : one.tensors()->tensors())
        CHECK(tensor.floats() == other.tensors()->tensors().at(name).floats());

    Program wrong_name(CLARUS_TOOL, {"model", network, "--output", folder / "net.bin"});
    CHECK(wrong_name.result() == 1);
    CHECK(wrong_name.errors().find("ends in .safetensors") != std::string::npos);

    std::string bytes = io::read_file(network);
    for (size_t at = bytes.find("Tanh"); at != std::string::npos; at = bytes.find("Tanh", at))
        bytes.replace(at, 4, "Sinh");
    std::ofstream(folder / "sinh.onnx", std::ios::binary) << bytes;
    for (const std::vector<std::string>& arguments :
         {std::vector<std::string>{"model", folder / "sinh.onnx"},
          {"upscale", "no-such-sequence", "--model", folder / "sinh.onnx", "--output", folder / "out"}}) {
        Program refused(CLARUS_TOOL, arguments);
        CHECK(refused.result() == 1);
        CHECK(refused.errors().find("the operator Sinh is not taken; these are: Add, ") != std::string::npos);
    }
}
