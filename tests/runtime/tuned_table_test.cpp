// What is shipped of others' measurements: that it is about what models ask for, and what it does.

#include "runtime/tuned_table.h"

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <filesystem>
#include <set>
#include <string>

#include "api/build_graph.h"
#include "clarus/error.h"
#include "clarus/model.h"
#include "operator_harness.h"
#include "runtime/plan.h"

using namespace clarus;
using namespace clarus::runtime;

namespace {

DeviceProfile device(DeviceClass device_class) {
    DeviceProfile profile;
    profile.device_class = device_class;
    profile.float_vector_width = device_class == DeviceClass::gpu ? 1 : 16;
    profile.memory_alignment = 128;
    profile.max_work_group_size = 256;
    profile.local_memory = 512 << 10;
    profile.half_storage = true;
    return profile;
}

const graph::Parameters kParameters{4, 4};

Problem convolution() {
    Problem problem;
    problem.node.op = graph::Convolution{0, graph::Activation::none};
    problem.node.shape = {4, 8, 16};
    problem.output = test::pixel_layout(problem.node.shape, Storage::f32);
    problem.inputs = {problem.output};
    problem.parameters = &kParameters;
    return problem;
}

/// A table of one entry about convolution().
TunedTable table(const DeviceProfile& profile, const Selection& best, double seconds, double built_in_seconds) {
    std::string choices;
    for (const auto& [name, value] : best.choices)
        choices += fmt::format("{}\"{}\": {}", choices.empty() ? "" : ", ", name, value);
    return {"one.json", fmt::format(R"({{"results": {{"{}, 0": {{"implementation": "{}", "choices": {{{}}},
                                       "seconds": {}, "built_in_seconds": {}}}}}}})",
                                    problem_key(convolution(), profile), best.implementation->name, choices, seconds,
                                    built_in_seconds)};
}

}  // namespace

TEST_CASE("what is shipped of measurements is about what shipped models ask for, and names kernels that there are") {
    for (const DeviceClass device_class : {DeviceClass::gpu, DeviceClass::cpu, DeviceClass::dsp}) {
        const TunedTable* shipped = TunedTable::of(device_class);
        if (!shipped) continue;
        const DeviceProfile profile = device(device_class);
        std::set<std::string> known;
        for (const auto& file : std::filesystem::recursive_directory_iterator(CLARUS_MODEL_DIR)) {
            if (file.path().extension() != ".safetensors") continue;
            const Model model = Model::load(file.path().string());
            const auto side = [&](int pixels) { return static_cast<int>(pixels / model.scale()); };
            for (const Precision precision : {Precision::fp32, Precision::fp16})
                for (const Size output : {Size{1920, 1080}, {2560, 1440}, {3840, 2160}}) {
                    PlanOptions options;
                    options.precision = precision;
                    const Size render{side(output.width), side(output.height)};
                    make_plan(
                        build_graph(model, render, output_size(render, model.scale())), options, profile,
                        [&](const Problem& problem) {
                            const std::string key = TunedTable::key_of(problem, profile);
                            const auto found = shipped->results().find(key);
                            if (found != shipped->results().end() && candidate_of(found->second, problem, profile))
                                known.insert(key);
                            return built_in_selection(problem, profile);
                        });
                }
        }
        for (const auto& [key, result] : shipped->results()) {
            CAPTURE(key);
            CAPTURE(result.implementation);
            CHECK(known.contains(key));
        }
    }
}

TEST_CASE("a table's choice is taken where it was faster by more than measuring errors, and can be run") {
    for (const DeviceClass device_class : {DeviceClass::gpu, DeviceClass::cpu}) {
        const DeviceProfile profile = device(device_class);
        const Selection obvious = obvious_selection(convolution(), profile);
        REQUIRE(obvious.describe() != built_in_selection(convolution(), profile).describe());
        const auto found = table(profile, obvious, 0.5, 1).find(convolution(), profile);
        REQUIRE(found);
        CHECK(found->describe() == obvious.describe());
        CHECK_FALSE(table(profile, obvious, 0.98, 1).find(convolution(), profile));
        Selection not_there = obvious;
        not_there.choices["OF_ANOTHER_RELEASE"] = 1;
        CHECK_FALSE(table(profile, not_there, 0.5, 1).find(convolution(), profile));
        Problem larger = convolution();
        larger.output.width = larger.inputs[0].width = 1 << 9;
        CHECK(table(profile, obvious, 0.5, 1).find(larger, profile));
        Problem half = convolution();
        half.output.storage = half.inputs[0].storage = Storage::f16;
        CHECK_FALSE(table(profile, obvious, 0.5, 1).find(half, profile));
    }
}

TEST_CASE("a file that is no table is refused with its name") {
    for (const char* text : {"", "[]", R"({"results": 3})", R"({"results": {"a, 0": {"implementation": "plain"}}})",
                             R"({"results": {"a": {"implementation": "plain", "choices": {}, "seconds": 1,
                                                   "built_in_seconds": 1}}})",
                             R"({"results": {"a, 0": {"implementation": "plain", "choices": {}, "seconds": 1,
                                                      "built_in_seconds": 1, "speed": 3}}})"}) {
        CAPTURE(text);
        CHECK_THROWS_WITH_AS(TunedTable("mine.json", text), doctest::Contains("mine.json"), Error);
    }
}
