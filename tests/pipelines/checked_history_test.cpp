#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "api/build_graph.h"
#include "clarus/error.h"
#include "clarus/upscaler.h"
#include "model_file.h"
#include "temporary_folder.h"
#include "test_device.h"

using namespace clarus;

// What the pipelines make of the metadata of docs/history.md.
namespace {

constexpr Size kRender{13, 9};
constexpr float kInvalid = std::numeric_limits<float>::quiet_NaN();

ModelFile golden_model(const std::string& name) {
    return ModelFile::read(std::string(CLARUS_GOLDEN_DIR) + "/" + name + ".model.safetensors");
}

/// A golden file's model that asks for that, its first layer made wider where it must be.
ModelFile asking(const std::string& name, const std::string& history, const std::string& range) {
    ModelFile model = golden_model(name);
    if (name.starts_with("enss")) {
        model = model.with_single_entry();
        if (history == "checked") {
            std::vector<int64_t> shape = model.header["first.weight"]["shape"];
            ++shape[2];
            std::mt19937 random(1);
            std::uniform_real_distribution<float> values(-0.2f, 0.2f);
            std::vector<float> weights(shape[1] * shape[2] * 9);
            for (float& weight : weights) weight = values(random);
            // What the file held under that name stays in it under another: its tensors have no gaps.
            model.header["unused"] = model.header["first.weight"];
            model.add("first.weight", shape, weights);
        }
    }
    model.header["__metadata__"]["history"] = history;
    model.header["__metadata__"]["range"] = range;
    return model;
}

graph::Graph build(const ModelFile& file) {
    const TemporaryFolder folder;
    file.write(folder / "model.safetensors");
    const Model model = Model::load((folder / "model.safetensors").string());
    return build_graph(model, kRender, output_size(kRender, model.scale()));
}

template <typename Op>
int count(const graph::Graph& graph) {
    return static_cast<int>(std::count_if(graph.nodes.begin(), graph.nodes.end(),
                                          [](const graph::Node& node) { return std::holds_alternative<Op>(node.op); }));
}

std::vector<size_t> operators(const graph::Graph& graph) {
    std::vector<size_t> result;
    for (const graph::Node& node : graph.nodes) result.push_back(node.op.index());
    return result;
}

Model load(const ModelFile& file) {
    const TemporaryFolder folder;
    file.write(folder / "model.safetensors");
    return Model::load((folder / "model.safetensors").string());
}

struct Sequence {
    std::vector<float> color, depth, motion;  // of one frame

    /// Frame `number`: a near square that moves before a far wall, colours from 0.25 to 0.75, some vectors invalid.
    explicit Sequence(int number) {
        std::mt19937 random(number);
        std::uniform_real_distribution<float> colors(0.25f, 0.75f);
        std::uniform_int_distribution kinds(0, 30);
        for (int y = 0; y < kRender.height; ++y)
            for (int x = 0; x < kRender.width; ++x) {
                const bool near = x >= number && x < number + 5 && y >= 2 && y < 7;
                for (int c = 0; c < 3; ++c) color.push_back(colors(random));
                depth.push_back(near ? 0.25f : 0.75f);
                const bool valid = kinds(random) > 0;
                motion.push_back(near ? -1.0f : 0.25f);
                motion.push_back(valid ? 0 : kInvalid);
            }
    }
};

/// Six frames, the fourth a cut, after each of which `see` is called with its output.
template <typename See>
Upscaler run(const Model& model, Precision precision, bool flat, See&& see, std::vector<std::string> views = {}) {
    UpscalerOptions options;
    options.precision = precision;
    options.views = std::move(views);
    Upscaler upscaler(test_device(), model, kRender, options);
    std::vector<float> output(static_cast<size_t>(3) * upscaler.output_size().width * upscaler.output_size().height);
    for (int number = 0; number < 6; ++number) {
        Sequence sequence(number);
        if (flat) std::fill(sequence.color.begin(), sequence.color.end(), 0.375f);
        FrameDescription frame;
        frame.color = {.host = sequence.color.data(), .size = kRender};
        frame.depth = {.host = sequence.depth.data(), .size = kRender};
        frame.motion = {.host = sequence.motion.data(), .size = kRender};
        frame.jitter = {number % 2 ? 0.25f : -0.25f, number % 4 < 2 ? 0.25f : -0.25f};
        frame.reset = number == 3;
        frame.output = {.host = output.data(), .size = upscaler.output_size()};
        upscaler.submit(frame).wait();
        see(output);
    }
    return upscaler;
}

bool all_within(const std::vector<float>& output, float low, float high) {
    return std::all_of(output.begin(), output.end(), [=](float value) { return value >= low && value <= high; });
}

constexpr std::pair<const char*, Precision> kRuns[] = {
    {"enss_x2_table", Precision::fp32}, {"enss_x2_table", Precision::fp16}, {"enss_x3_table", Precision::fp32},
    {"mnss_x2", Precision::fp32},       {"mnss_x2", Precision::fp16},       {"nsrr_x2_rgb", Precision::fp32},
    {"nsrr_x2_rgb", Precision::fp16},   {"nsrr_x3_alone", Precision::fp32},
};

}  // namespace

TEST_CASE("a model that asks for nothing has the published graph") {
    for (const char* name : {"enss_x2_table", "mnss_x2", "nsrr_x2_rgb", "nsrr_x4"}) {
        CAPTURE(std::string(name));
        const graph::Graph published = build(golden_model(name));
        CHECK(count<graph::CheckedMotion>(published) + count<graph::Reproject>(published) == 0);
        CHECK(count<graph::Range>(published) == 0);
        ModelFile said = golden_model(name);
        said.header["__metadata__"]["history"] = "plain";
        said.header["__metadata__"]["range"] = "unit";
        CHECK(operators(build(said)) == operators(published));
    }
}

TEST_CASE("a model's history is checked and its range held where it asks for it") {
    for (const char* name : {"enss_x2_table", "mnss_x2", "nsrr_x2_rgb"}) {
        CAPTURE(std::string(name));
        const graph::Graph checked = build(asking(name, "checked", "unit"));
        CHECK(count<graph::CheckedMotion>(checked) == 1);
        CHECK(count<graph::Reproject>(checked) == 1);
        CHECK(count<graph::Dilate>(checked) + count<graph::UpsampleMotion>(checked) == 0);
        CHECK(count<graph::Range>(checked) == 0);
        CHECK(checked.views.contains("validity"));
        const graph::Graph held = build(asking(name, "plain", "held"));
        CHECK(count<graph::Range>(held) == 1);
        CHECK(std::get<graph::Pointwise>(held.nodes[held.output].op).steps.back().function ==
              graph::Step::Function::minimum);
        CHECK(count<graph::CheckedMotion>(held) + count<graph::Reproject>(held) == 0);
        CHECK_FALSE(held.views.contains("validity"));
    }
    const auto states = [](const char* range) { return build(asking("nsrr_x2_rgb", "plain", range)).states.size(); };
    CHECK(states("held") == states("unit") + 1);
}

TEST_CASE("a held range is that of what was seen since the cut") {
    for (const auto& [name, precision] : kRuns) {
        CAPTURE(std::string(name));
        CAPTURE(static_cast<int>(precision));
        const Model model = load(asking(name, "checked", "held"));
        // Filters' weights sum to 1 but for rounding errors; at scale 2 they are exact here.
        const float rounding = precision == Precision::fp16 ? 0 : 1e-6f;
        run(model, precision, false,
            [&](const std::vector<float>& output) { CHECK(all_within(output, 0.25f - rounding, 0.75f + rounding)); });
        const float uneven = model.scale() == 2 ? 0 : rounding;
        run(model, precision, true,
            [&](const std::vector<float>& output) { CHECK(all_within(output, 0.375f - uneven, 0.375f + uneven)); });
    }
}

TEST_CASE("a range that is not held is left") {
    for (const char* name : {"enss_x2_table", "mnss_x2", "nsrr_x2_rgb"}) {
        CAPTURE(std::string(name));
        bool left = false;
        run(load(asking(name, "checked", "unit")), Precision::fp32, false,
            [&](const std::vector<float>& output) { left = left || !all_within(output, 0.25f, 0.75f); });
        CHECK(left);
    }
}

TEST_CASE("what was hidden has no history") {
    for (const char* name : {"enss_x2_table", "mnss_x2", "nsrr_x2_rgb"}) {
        CAPTURE(std::string(name));
        const Upscaler upscaler = run(load(asking(name, "checked", "held")), Precision::fp32, false,
                                      [](const std::vector<float>&) {}, {"validity"});
        const std::vector<float> seen = upscaler.view("validity").pixels;
        const auto validity = [&](int x, int y) { return seen[static_cast<size_t>(y) * kRender.width + x]; };
        // Of the last frame: the square stands from column 5 to 9 and stood one to the left; the wall moves to the left
        // by a quarter of a pixel, and so does what it shows at the right border.
        const Sequence last(5);
        const auto is_valid = [&](int x, int y) {
            return std::isfinite(last.motion[2 * (static_cast<size_t>(y) * kRender.width + x) + 1]);
        };
        for (int y = 3; y < 6; ++y) {
            CHECK(validity(4, y) == 0);
            for (const int x : {1, 6, 7, 8, 11}) CHECK(validity(x, y) == (is_valid(x, y) ? 1 : 0));
        }
    }
}

TEST_CASE("metadata that no history is known for is refused by name" * doctest::test_suite("small")) {
    for (const char* name : {"enss_x2_1x1", "mnss_x2_1x1", "nsrr_x6_1x1"})
        for (const auto& [key, value, known] :
             {std::array{"history", "rigged", "plain, checked"}, std::array{"range", "wide", "unit, held"},
              std::array{"history", "", "plain, checked"}}) {
            CAPTURE(std::string(name));
            ModelFile model = golden_model(name);
            model.header["__metadata__"][key] = value;
            CHECK_THROWS_WITH_AS(load(model), doctest::Contains(key), Error);
            CHECK_THROWS_WITH_AS(load(model), doctest::Contains(known), Error);
        }
    ModelFile misspelt = golden_model("mnss_x2_1x1");
    misspelt.header["__metadata__"]["comment"] = "for people";
    CHECK_NOTHROW(load(misspelt));
    misspelt.header["__metadata__"]["Histroy"] = "checked";
    CHECK_THROWS_WITH_AS(load(misspelt), doctest::Contains("unknown key `Histroy`; is it `history`?"), Error);
    misspelt.header["__metadata__"]["history"] = "plain";
    CHECK_NOTHROW(load(misspelt));
    ModelFile narrow = golden_model("enss_x2_table");
    narrow.header["__metadata__"]["history"] = "checked";
    CHECK_THROWS_WITH_AS(load(narrow), doctest::Contains("first.weight"), Error);
}
