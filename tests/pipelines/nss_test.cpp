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

using namespace clarus;
using namespace clarus::test;

namespace {

constexpr double kTolerance = 5e-5;  // eight recurrent frames in float against double
// Of radiance without bound the variance is a difference of large numbers: PyTorch's own float network is 3e-4 away.
constexpr double kLinearTolerance = 5e-4;

}  // namespace

TEST_CASE("NSS agrees with the PyTorch network over eight frames and a reset" * doctest::test_suite("golden")) {
    for (const char* name : {"nss_x2", "nss_x1.5", "nss_x1.7", "nss_x3", "nss_x2_1x1"}) {
        CAPTURE(name);
        for (const double difference : run(Golden(name)).differences) CHECK(difference < kTolerance);
    }
}

TEST_CASE("NSS of tone-mapped radiance agrees with the PyTorch network" * doctest::test_suite("golden")) {
    for (const double difference : run(Golden("nss_x2_linear")).differences) CHECK(difference < kLinearTolerance);
}

TEST_CASE("NSS on the smallest image agrees with the PyTorch network" * doctest::test_suite("small")) {
    for (const double difference : run(Golden("nss_x2_1x1"), {}, 2).differences) CHECK(difference < kTolerance);
}

TEST_CASE("NSS shows what it saw inside" * doctest::test_suite("golden")) {
    const std::vector<std::string> all = {"disocclusion", "instability", "temporal"};
    for (const std::vector<std::string>& views : {all, {"instability"}}) {
        UpscalerOptions options;
        options.views = views;
        const Golden golden("nss_x1.5");
        const Run result = run(golden, options, kViewedFrame + 1);
        for (const std::string& name : views) {
            CAPTURE(name);
            CHECK(view_difference(result.upscaler, golden, name) < kTolerance);
        }
    }
}

TEST_CASE("NSS computes the same with all its views kept" * doctest::test_suite("golden")) {
    const Golden golden("nss_x3");
    UpscalerOptions options;
    options.views = run(golden, {}, 1).upscaler.view_names();
    for (const double difference : run(golden, options).differences) CHECK(difference < kTolerance);
}

TEST_CASE("NSS in bands agrees with the PyTorch network" * doctest::test_suite("golden")) {
    UpscalerOptions options;
    options.band_rows = 8;
    for (const double difference : run(Golden("nss_x1.5"), options).differences) CHECK(difference < kTolerance);
}

TEST_CASE("NSS in half storage stays near" * doctest::test_suite("golden")) {
    UpscalerOptions options;
    options.precision = Precision::fp16;
    for (const double difference : run(Golden("nss_x1.7"), options).differences) CHECK(difference < 0.02);
}

TEST_CASE("NSS files say their scale and white, or are as published") {
    const TemporaryFolder folder;
    const std::filesystem::path path = folder.path() / "model.safetensors";
    const ModelFile golden = ModelFile::read(std::string(CLARUS_GOLDEN_DIR) + "/nss_x1.7.model.safetensors");
    const auto load_with = [&](const nlohmann::json& metadata, double scale = 2) {
        ModelFile file = golden;
        file.header.erase("__metadata__");
        if (!metadata.empty()) file.header["__metadata__"] = metadata;
        file.write(path);
        return Model::load(path.string(), scale);
    };
    CHECK(load_with({{"pipeline", "nss"}, {"scale", "1.7"}, {"white", "4"}}).scale() == 1.7);
    const Model published = load_with({}, 1.5);
    CHECK(published.pipeline() == "nss");
    CHECK(published.scale() == 1.5);
    CHECK(Model::find(path.string(), 2.25).scale() == 2.25);
    for (const auto& [metadata, scale, wanted] :
         {std::tuple{nlohmann::json{{"pipeline", "nss"}, {"scale", "3.5"}}, 2.0,
                     "\"scale\" must be a number from 1 to 3"},
          {nlohmann::json{{"pipeline", "nss"}, {"scale", "two"}}, 2.0, "\"scale\" must be a number from 1 to 3"},
          {nlohmann::json{{"pipeline", "nss"}, {"scale", "2"}, {"white", "0.5"}}, 2.0, "\"white\" must be a number"},
          {nlohmann::json{{"scale", "2"}, {"white", "nan"}}, 2.0, "\"white\" must be a number"},
          {nlohmann::json::object(), 4.0, "scale 4; this model's are from 1 to 3"}}) {
        CAPTURE(metadata.dump());
        std::string message;
        try {
            load_with(metadata, scale);
        } catch (const Error& error) {
            message = error.what();
        }
        CHECK(message.find(wanted) != std::string::npos);
        CHECK(message.find("model.safetensors") != std::string::npos);
    }
}

TEST_CASE("a network of whole scales is not of any") {
    const TemporaryFolder folder;
    const std::filesystem::path path = folder.path() / "model.safetensors";
    ModelFile file = ModelFile::read(CLARUS_GOLDEN_DIR "/mnss_x2.model.safetensors");
    file.header["__metadata__"]["scale"] = "any";
    file.write(path);
    CHECK_THROWS_WITH_AS(Model::load(path.string()), doctest::Contains("whole number from 2 to 3, not \"any\""), Error);
}
