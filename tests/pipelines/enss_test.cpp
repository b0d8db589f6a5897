#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <random>
#include <string>

#include "clarus/error.h"
#include "clarus/upscaler.h"
#include "golden.h"
#include "io/safetensors.h"
#include "model_file.h"
#include "temporary_folder.h"
#include "test_device.h"

using namespace clarus;
using namespace clarus::test;

namespace {

constexpr double kTolerance = 2e-5;  // eight recurrent frames in float against double

}  // namespace

TEST_CASE("ENSS agrees with the PyTorch network over eight frames and a reset" * doctest::test_suite("golden")) {
    for (const char* name : {"enss_x2_table", "enss_x3_table", "enss_x4_single", "enss_x2_mlp", "enss_x2_1x1",
                             "enss_x2_held", "enss_x3_checked"}) {
        CAPTURE(name);
        const Run result = run(Golden(name));
        for (const double difference : result.differences) CHECK(difference < kTolerance);
    }
}

TEST_CASE("ENSS on the smallest image agrees with the PyTorch network" * doctest::test_suite("small")) {
    const Run result = run(Golden("enss_x2_1x1"));
    for (const double difference : result.differences) CHECK(difference < kTolerance);
}

TEST_CASE("ENSS shows what it saw inside" * doctest::test_suite("golden")) {
    UpscalerOptions options;
    options.views = {"alpha", "candidate", "warped"};
    const Golden golden("enss_x2_table");
    const Run result = run(golden, options, kViewedFrame + 1);
    for (const std::string& name : options.views) {
        CAPTURE(name);
        CHECK(view_difference(result.upscaler, golden, name) <
              5 * kTolerance);  // the candidate is not confined to [0, 1]
    }
}

TEST_CASE("ENSS in half storage stays near" * doctest::test_suite("golden")) {
    UpscalerOptions options;
    options.precision = Precision::fp16;
    const Run result = run(Golden("enss_x2_table"), options);
    for (const double difference : result.differences) CHECK(difference < 0.02);
}

TEST_CASE("a jitter that the table lacks is reported with its distance" * doctest::test_suite("golden")) {
    CHECK(run(Golden("enss_x2_table")).upscaler.largest_jitter_distance() == 0);
    CHECK(run(Golden("enss_x3_table")).upscaler.largest_jitter_distance() ==
          doctest::Approx(0.004 * std::sqrt(2.0)).epsilon(0.01));
    CHECK(run(Golden("enss_x2_mlp")).upscaler.largest_jitter_distance() == 0);
}

TEST_CASE("a table's entry is used near its jitter, the perceptron elsewhere, a single entry everywhere") {
    const ModelFile perceptron = ModelFile::read(std::string(CLARUS_GOLDEN_DIR) + "/enss_x2_mlp.model.safetensors");
    constexpr Vec2 entries[] = {{0.1f, 0.2f}, {-0.3f, 0.4f}};
    const TemporaryFolder folder;
    const auto model = [&](int sets, bool with_perceptron) {
        std::mt19937 generator(sets);
        std::uniform_real_distribution<float> unit(-0.2f, 0.2f);
        ModelFile file;
        file.take(perceptron, "body.");
        if (with_perceptron) file.take(perceptron, "mlp.");
        const auto add = [&](const std::string& name, std::vector<int64_t> shape) {
            size_t count = 1;
            for (const int64_t extent : shape) count *= extent;
            std::vector<float> values(count);
            for (float& value : values) value = unit(generator);
            file.add(name, shape, values);
        };
        if (sets > 0) {
            std::vector<float> jitters;
            for (int set = 0; set < sets; ++set) jitters.insert(jitters.end(), {entries[set].x, entries[set].y});
            file.add("jitter", {sets, 2}, jitters);
            add("first.weight", {sets, 8, 22, 3, 3});
            add("first.bias", {sets, 8});
            add("last.weight", {sets, 20, 8, 3, 3});
            add("last.bias", {sets, 20});
        }
        file.write(folder / "model.safetensors");
        return Model::load((folder / "model.safetensors").string());
    };

    const Golden golden("enss_x2_mlp");
    std::vector<float> color = golden.tensor("color"), depth = golden.tensor("depth"), motion = golden.tensor("motion");
    const auto frame_of = [&](const Model& used, Vec2 jitter) {
        Upscaler upscaler(test_device(), used, golden.render);
        std::vector<float> output(static_cast<size_t>(12) * golden.render.width * golden.render.height);
        FrameDescription frame;
        frame.color = {.host = color.data(), .size = golden.render};
        frame.depth = {.host = depth.data(), .size = golden.render};
        frame.motion = {.host = motion.data(), .size = golden.render};
        frame.jitter = jitter;
        frame.output = {.host = output.data(), .size = upscaler.output_size()};
        upscaler.submit(frame).wait();
        CHECK((!used.tensors()->has("mlp.0.weight") || upscaler.largest_jitter_distance() == 0));
        return output;
    };

    const Model by_perceptron = model(0, true), table = model(2, false), both = model(2, true),
                single = model(1, false), single_and_perceptron = model(1, true);
    for (const Vec2 entry : entries) {
        const Vec2 near{entry.x + 0.0006f, entry.y - 0.0006f}, beyond{entry.x + 0.0009f, entry.y - 0.0009f};
        CHECK(frame_of(both, near) == frame_of(table, near));
        CHECK(frame_of(both, near) != frame_of(by_perceptron, near));
        CHECK(frame_of(both, beyond) == frame_of(by_perceptron, beyond));
        CHECK(frame_of(both, beyond) != frame_of(table, beyond));
    }
    for (const Vec2 jitter : {entries[0], entries[1], Vec2{-0.5f, 0.5f}})
        CHECK(frame_of(single_and_perceptron, jitter) == frame_of(single, jitter));
    CHECK(frame_of(single, entries[1]) != frame_of(by_perceptron, entries[1]));
}

TEST_CASE("a model that lacks a tensor of a group is refused with the tensor's name" * doctest::test_suite("small")) {
    const TemporaryFolder folder;
    // Names of the same length, so that the file stays whole.
    const auto renamed = [&](const std::string& model, const std::string& from, const std::string& to) {
        std::ifstream original(std::string(CLARUS_GOLDEN_DIR) + "/" + model + ".model.safetensors", std::ios::binary);
        std::string bytes((std::istreambuf_iterator<char>(original)), {});
        const size_t place = bytes.find("\"" + from + "\"");
        REQUIRE(place != std::string::npos);
        bytes.replace(place + 1, from.size(), to);
        const std::string path = (folder / "renamed.safetensors").string();
        std::ofstream(path, std::ios::binary) << bytes;
        return path;
    };
    for (const auto& [model, from, to] :
         {std::array{"enss_x4_single", "body.0.weight", "body.5.weight"},
          std::array{"enss_x4_single", "body.0.weight", "lost.0.weight"},
          std::array{"enss_x4_single", "body.1.weight", "lost.1.weight"},
          std::array{"enss_x4_single", "body.1.bias", "body.7.bias"},
          std::array{"enss_x2_table", "first.weight", "worst.weight"},
          std::array{"enss_x2_table", "last.bias", "lost.bias"}, std::array{"enss_x2_table", "jitter", "gitter"},
          std::array{"enss_x2_mlp", "mlp.0.weight", "mlp.9.weight"},
          std::array{"enss_x2_mlp", "mlp.3.bias", "mlp.9.bias"}}) {
        CAPTURE(from);
        CHECK_THROWS_WITH_AS(Model::load(renamed(model, from, to)), doctest::Contains(from), Error);
    }
}
