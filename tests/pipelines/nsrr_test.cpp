#include <doctest/doctest.h>

#include <array>
#include <string>
#include <vector>

#include "clarus/error.h"
#include "clarus/upscaler.h"
#include "golden.h"
#include "model_file.h"
#include "temporary_folder.h"
#include "test_device.h"

using namespace clarus;
using namespace clarus::test;

namespace {

constexpr double kTolerance = 2e-5;  // eight recurrent frames in float against double

void check_golden(const std::string& name, UpscalerOptions options = {}, double tolerance = kTolerance) {
    CAPTURE(name);
    for (const double difference : run(Golden(name), std::move(options)).differences) CHECK(difference < tolerance);
}

}  // namespace

TEST_CASE("NSRR agrees with the PyTorch network over eight frames and a reset" * doctest::test_suite("golden")) {
    for (const char* name : {"nsrr_x4", "nsrr_x2_rgb", "nsrr_x3_alone", "nsrr_x5_ragged", "nsrr_x2_checked"})
        check_golden(name);
}

TEST_CASE("NSRR on the smallest image agrees with the PyTorch network" * doctest::test_suite("small")) {
    check_golden("nsrr_x6_1x1");
}

TEST_CASE("NSRR with fewer previous frames than it has: the others' maps are zero" * doctest::test_suite("golden")) {
    UpscalerOptions options;
    options.pipeline_options["previous_frames"] = 1;
    check_golden("nsrr_x3_used", options);
}

TEST_CASE("NSRR without previous frames needs depth, but no motion" * doctest::test_suite("golden")) {
    const Golden alone("nsrr_x3_alone"), model("nsrr_x4");
    UpscalerOptions options;
    CHECK_FALSE(Upscaler(test_device(), alone.model, alone.render, options).needs_motion());
    CHECK(Upscaler(test_device(), model.model, model.render, options).needs_motion());
    options.pipeline_options["previous_frames"] = 0;
    const Run result = run(model, options, 2);
    CHECK_FALSE(result.upscaler.needs_motion());
    CHECK(result.upscaler.needs_depth());
}

TEST_CASE("NSRR in bands of rows agrees with the PyTorch network" * doctest::test_suite("golden")) {
    UpscalerOptions options;
    options.band_rows = 8;
    options.profile = true;
    const Golden golden("nsrr_x2_rgb");
    Run result = run(golden, options);
    for (const double difference : result.differences) CHECK(difference < kTolerance);
    // It does work in bands: a layer is launched many times a frame.
    for (const StageProfile& stage : result.upscaler.take_profile())
        if (stage.name == "unet.enc1.0") CHECK(stage.spans.size() > static_cast<size_t>(4 * golden.frames));
}

TEST_CASE("NSRR in half storage stays near" * doctest::test_suite("golden")) {
    UpscalerOptions options;
    options.precision = Precision::fp16;
    check_golden("nsrr_x4", options, 0.02);
}

TEST_CASE("NSRR shows what it saw inside, in bands too" * doctest::test_suite("golden")) {
    for (const auto& [name, band_rows] : {std::pair{"nsrr_x4", 0}, {"nsrr_x2_rgb", 8}}) {
        CAPTURE(std::string(name));
        UpscalerOptions options;
        options.views = {"features", "warped", "weights"};
        options.band_rows = band_rows;
        const Golden golden(name);
        const Run result = run(golden, options, kViewedFrame + 1);
        for (const double difference : result.differences) CHECK(difference < kTolerance);
        for (const std::string& view : options.views) {
            CAPTURE(view);
            CHECK(view_difference(result.upscaler, golden, view) < 5 * kTolerance);  // weights go up to 10
            CHECK(result.upscaler.view(view).maps);
        }
    }
}

TEST_CASE("NSRR's memory is bounded") {
    const TemporaryFolder folder;
    ModelFile file;
    file.header["__metadata__"] = {
        {"pipeline", "nsrr"}, {"scale", "4"}, {"previous_frames", "4"}, {"network_color", "ycbcr"}};
    const auto add_layers = [&](const std::string& name, int64_t in, const std::vector<int64_t>& outputs) {
        for (size_t layer = 0; layer < outputs.size(); in = outputs[layer++]) {
            const std::string full_name = name + "." + std::to_string(layer);
            const int64_t out = outputs[layer];
            file.add(full_name + ".weight", {out, in, 3, 3}, std::vector<float>(out * in * 9));
            file.add(full_name + ".bias", {out}, std::vector<float>(out));
        }
    };
    add_layers("features_current", 4, {32, 32, 8});
    add_layers("features_previous", 4, {32, 32, 8});
    add_layers("reweight", 20, {32, 32, 4});
    add_layers("unet.enc1", 60, {64, 32});
    add_layers("unet.enc2", 32, {64, 64});
    add_layers("unet.bottleneck", 64, {128, 128});
    add_layers("unet.dec2", 192, {64, 64});
    add_layers("unet.dec1", 96, {32, 3});
    file.write(folder / "model.safetensors");
    const Model model = Model::load((folder / "model.safetensors").string());
    const auto gibibytes = [&](Size render) {
        return static_cast<double>(Upscaler(test_device(), model, render).memory_requirements().total()) / (1 << 30);
    };
    CHECK(gibibytes({480, 270}) < 1.2);
    CHECK(gibibytes({960, 540}) < 3);
    // Maps of 8K have more elements than a kernel can count, their rings have not.
    CHECK(gibibytes({1920, 1080}) < 12);
    MESSAGE(gibibytes({480, 270}) << " GiB at 1080p, " << gibibytes({960, 540}) << " GiB at 4K");
}

TEST_CASE("an upscaler that shows nothing inside has no views of maps that there are not") {
    UpscalerOptions options;
    options.pipeline_options["previous_frames"] = 0;
    const Golden golden("nsrr_x4");
    const Upscaler upscaler(test_device(), golden.model, golden.render, options);
    for (const std::string& name : upscaler.view_names()) CHECK((name != "weights" && name != "warped"));
}

TEST_CASE("more previous frames than there are, and those of other pipelines, are refused") {
    UpscalerOptions options;
    options.pipeline_options["previous_frames"] = 3;
    const Golden nsrr("nsrr_x2_rgb"), enss("enss_x2_1x1");
    const auto create = [&](const Model& model) { Upscaler(test_device(), model, {8, 8}, options); };
    REQUIRE(nsrr.model.options().size() == 1);
    CHECK(nsrr.model.options()[0].usual == 2);
    CHECK_THROWS_WITH_AS(create(nsrr.model),
                         doctest::Contains("of nsrr_x2_rgb.model it must be a whole number from 0 to 2"), Error);
    CHECK_THROWS_WITH_AS(create(enss.model), doctest::Contains("previous_frames"), Error);
    CHECK_THROWS_WITH_AS(create(Model::filter("bicubic", 2)), doctest::Contains("previous_frames"), Error);
}

TEST_CASE("an NSRR model that does not fit together is refused with the name of what is wrong" *
          doctest::test_suite("small")) {
    const TemporaryFolder folder;
    const ModelFile whole = ModelFile::read(std::string(CLARUS_GOLDEN_DIR) + "/nsrr_x2_rgb.model.safetensors");
    const auto load = [&](const ModelFile& file) {
        file.write(folder / "model.safetensors");
        Model::load((folder / "model.safetensors").string());
    };
    for (const char* name : {"features_current.0.weight", "features_previous.2.bias", "reweight.1.weight",
                             "reweight.2.bias", "unet.enc1.0.weight", "unet.bottleneck.1.bias", "unet.dec1.1.weight"}) {
        CAPTURE(name);
        ModelFile file = whole;
        file.header[std::string(name) + "_"] = file.header[name];
        file.header.erase(name);
        CHECK_THROWS_WITH_AS(load(file), doctest::Contains(name), Error);
        file = whole;
        file.header[name]["shape"].push_back(1);
        CHECK_THROWS_WITH_AS(load(file), doctest::Contains(name), Error);
    }
    for (const auto& [key, value] : {std::array{"network_color", "hsv"}, std::array{"previous_frames", "5"},
                                     std::array{"previous_frames", "four"}}) {
        CAPTURE(key);
        ModelFile file = whole;
        file.header["__metadata__"][key] = value;
        CHECK_THROWS_WITH_AS(load(file), doctest::Contains(key), Error);
        file.header["__metadata__"].erase(key);
        CHECK_THROWS_WITH_AS(load(file), doctest::Contains(key), Error);
    }
}
