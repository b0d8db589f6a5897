#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "clarus/error.h"
#include "golden.h"
#include "model_file.h"
#include "temporary_folder.h"
#include "test_device.h"

using namespace clarus;
using namespace clarus::test;

namespace {

constexpr double kTolerance = 2e-5;  // eight recurrent frames in float against double

const std::string kModel = std::string(CLARUS_GOLDEN_DIR) + "/clarus_x2.model.safetensors";

}  // namespace

TEST_CASE("Clarus agrees with the PyTorch network over eight frames and a reset" * doctest::test_suite("golden")) {
    for (const char* name : {"clarus_x2", "clarus_x1_5", "clarus_x3_4", "clarus_x4_1x1"}) {
        CAPTURE(name);
        const Run result = run(Golden(name));
        for (const double difference : result.differences) CHECK(difference < kTolerance);
    }
}

TEST_CASE("Clarus on the smallest image agrees with the PyTorch network" * doctest::test_suite("small")) {
    const Run result = run(Golden("clarus_x4_1x1"));
    for (const double difference : result.differences) CHECK(difference < kTolerance);
}

TEST_CASE("Clarus shows what it saw inside" * doctest::test_suite("golden")) {
    const Golden golden("clarus_x1_5");
    UpscalerOptions options;
    options.views = run(golden, {}, 1).upscaler.view_names();
    const Run result = run(golden, options, kViewedFrame + 1);
    CHECK(view_difference(result.upscaler, golden, "weight") < kTolerance);
    for (const double difference : result.differences) CHECK(difference < kTolerance);
}

TEST_CASE("Clarus in bands agrees with the PyTorch network" * doctest::test_suite("golden")) {
    UpscalerOptions options;
    options.band_rows = 8;
    for (const double difference : run(Golden("clarus_x1_5"), options).differences) CHECK(difference < kTolerance);
}

TEST_CASE("Clarus in half storage stays near" * doctest::test_suite("golden")) {
    UpscalerOptions options;
    options.precision = Precision::fp16;
    const Run result = run(Golden("clarus_x1_5"), options);
    for (const double difference : result.differences) CHECK(difference < 0.05);
}

TEST_CASE("a model of any scale takes those from 1.3 to 4" * doctest::test_suite("small")) {
    const Model model = Model::load(kModel, 1.7);
    CHECK(model.scale() == 1.7);
    CHECK(model.scales().smallest == 1.3);
    CHECK(model.scales().largest == 4);
    CHECK_FALSE(model.scales().is_single());
    CHECK(Model::load(kModel).scale() == 2);
    CHECK(Upscaler(test_device(), model, {10, 9}).output_size() == Size{17, 15});
    for (const double scale : {1.0, 1.29, 4.01, -2.0, std::numeric_limits<double>::quiet_NaN()}) {
        CAPTURE(scale);
        CHECK_THROWS_WITH_AS(Model::load(kModel, scale), doctest::Contains("from 1.3 to 4"), Error);
    }
    CHECK(std::isinf(Model::filter("bicubic", 3).scales().largest));
    CHECK(Model::load(std::string(CLARUS_GOLDEN_DIR) + "/enss_x3_table.model.safetensors", 1.5).scales().is_single());
}

TEST_CASE("a damaged model is refused with the name of what is wrong" * doctest::test_suite("small")) {
    const TemporaryFolder folder;
    const std::string path = (folder / "model.safetensors").string();
    const ModelFile whole = ModelFile::read(kModel);
    for (const char* missing : {"layers.0.weight", "layers.1.bias", "layers.2.weight"}) {
        ModelFile file = whole;
        file.header["lost"] = file.header[missing];
        file.header.erase(missing);
        file.write(path);
        CHECK_THROWS_WITH_AS(Model::load(path), doctest::Contains(missing), Error);
    }
    ModelFile file = whole;
    file.header["__metadata__"]["scale"] = "5";
    file.write(path);
    CHECK_THROWS_WITH_AS(Model::load(path), doctest::Contains("number from 1.3 to 4, not \"5\""), Error);
    file.header["__metadata__"]["scale"] = "2";
    file.write(path);
    CHECK(Model::load(path, 3).scale() == 2);  // for one scale alone

    file = ModelFile::read(std::string(CLARUS_GOLDEN_DIR) + "/mnss_x2.model.safetensors");
    file.header["__metadata__"]["scale"] = "any";
    file.write(path);
    CHECK_THROWS_WITH_AS(Model::load(path), doctest::Contains("whole number from 2 to 3, not \"any\""), Error);
}
