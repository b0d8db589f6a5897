#include <doctest/doctest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <tuple>
#include <vector>

#include "clarus/error.h"
#include "golden.h"
#include "model_file.h"
#include "temporary_folder.h"
#include "test_device.h"

using namespace clarus;
using namespace clarus::test;

namespace {

constexpr double kTolerance = 5e-5;  // eight recurrent frames in float against double; trust is steep

}  // namespace

TEST_CASE("Clarus agrees with the PyTorch network over eight frames and a reset" * doctest::test_suite("golden")) {
    for (const std::string name : {"clarus_x2", "clarus_x3", "clarus_x4_1x1", "clarus_x1.5", "clarus_x2.5"}) {
        CAPTURE(name);
        const Run result = run(Golden(name));
        for (const double difference : result.differences) CHECK(difference < kTolerance);
    }
}

TEST_CASE("Clarus on the smallest image agrees with the PyTorch network" * doctest::test_suite("small")) {
    for (const double difference : run(Golden("clarus_x4_1x1")).differences) CHECK(difference < kTolerance);
}

TEST_CASE("Clarus shows what it saw inside" * doctest::test_suite("golden")) {
    const std::vector<std::string> all = {"trust", "collected", "details"};
    for (const std::vector<std::string>& views : {all, {"trust"}}) {
        UpscalerOptions options;
        options.views = views;
        const Golden golden("clarus_x3");
        const Run result = run(golden, options, kViewedFrame + 1);
        for (const std::string& name : views) {
            CAPTURE(name);
            CHECK(view_difference(result.upscaler, golden, name) < kTolerance);
        }
    }
}

TEST_CASE("Clarus computes the same with all its views kept, and in bands" * doctest::test_suite("golden")) {
    const Golden golden("clarus_x2");
    UpscalerOptions viewed, banded;
    viewed.views = run(golden, {}, 1).upscaler.view_names();
    banded.band_rows = 8;
    for (const UpscalerOptions& options : {viewed, banded})
        for (const double difference : run(golden, options).differences) CHECK(difference < kTolerance);
}

TEST_CASE("Clarus in half storage stays near" * doctest::test_suite("golden")) {
    UpscalerOptions options;
    options.precision = Precision::fp16;
    for (const double difference : run(Golden("clarus_x2"), options).differences) CHECK(difference < 0.02);
}

TEST_CASE("Clarus files have a network for every scale that they allow") {
    const TemporaryFolder folder;
    const std::filesystem::path path = folder.path() / "model.safetensors";
    const auto at = [&](const char* golden, const char* allowed, double scale) {
        ModelFile file = ModelFile::read(std::string(CLARUS_GOLDEN_DIR "/") + golden + ".model.safetensors");
        file.header["__metadata__"]["scale"] = allowed;
        file.write(path);
        const Model model = Model::load(path.string(), scale);
        return Upscaler(test_device(), model, {8, 6}).output_size();
    };
    CHECK(at("clarus_x2.5", "any", 1) == Size{8, 6});
    CHECK(at("clarus_x2.5", "any", 3.5) == Size{28, 21});
    CHECK(at("clarus_x2.5", "2.25", 2) == Size{18, 14});  // the file's, whatever was asked for
    CHECK(at("clarus_x3", "any", 1.5) == Size{12, 9});    // by the network for 3
    CHECK(at("clarus_x2", "any", 2.01) == Size{16, 12});
    for (const auto& [golden, allowed, scale, wanted] :
         {std::tuple{"clarus_x2", "any", 2.5, "no network for a scale of 2.5: tensor x3.0.weight is missing"},
          {"clarus_x3", "4", 4.0, "no network for a scale of 4: tensor x4.0.weight is missing"},
          {"clarus_x3", "5", 3.0, "\"scale\" must be a number from 1 to 4"},
          {"clarus_x2.5", "any", 4.5, "scale 4.5; this model's are from 1 to 4"}}) {
        CAPTURE(wanted);
        CHECK_THROWS_WITH_AS(at(golden, allowed, scale), doctest::Contains(wanted), Error);
        CHECK_THROWS_WITH_AS(at(golden, allowed, scale), doctest::Contains("model.safetensors"), Error);
    }
}
