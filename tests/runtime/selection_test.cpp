// Which kernels devices are given that nothing was measured on: by their class alone, so that it can be tested without
// them.

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cstring>
#include <filesystem>
#include <map>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "api/build_graph.h"
#include "clarus/model.h"
#include "convolution_harness.h"
#include "runtime/plan.h"
#include "runtime/tuner.h"

using namespace clarus;
using namespace clarus::runtime;

namespace {

/// A device as vendors sell it: enough of everything.
DeviceProfile device(DeviceClass device_class, int float_vector_width) {
    DeviceProfile profile;
    profile.device_class = device_class;
    profile.float_vector_width = float_vector_width;
    profile.memory_alignment = 128;
    profile.max_work_group_size = 256;
    profile.local_memory = device_class == DeviceClass::gpu ? 32 << 10 : 512 << 10;
    profile.half_storage = true;
    return profile;
}

/// Those that come with Clarus, and one of NSS, which has none there.
std::vector<Model> models() {
    std::vector<Model> result{Model::filter("fsr1", 2), Model::filter("fsr2", 2)};
    for (const auto& file : std::filesystem::recursive_directory_iterator(CLARUS_MODEL_DIR))
        if (file.path().extension() == ".safetensors") result.push_back(Model::load(file.path().string()));
    result.push_back(Model::load(CLARUS_GOLDEN_DIR "/nss_x2.model.safetensors"));
    return result;
}

/// By the obvious kernel of an operator that has others, the kernels that it is given in any of the models: a line for
/// each, "plain: direct, winograd".
std::string chosen(const DeviceProfile& profile) {
    std::map<std::string, std::set<std::string>> kernels;
    constexpr Size kRender{960, 540};
    const runtime::PlanOptions options;
    for (const Model& model : models()) {
        const auto plan = make_plan(build_graph(model, kRender, output_size(kRender, model.scale())), options, profile,
                                    [&](const Problem& problem) { return built_in_selection(problem, profile); });
        for (const PlannedStage& stage : plan->stages) {
            const auto all = implementations(stage.problem.node);
            if (all.size() > 1) kernels[all.back().name].insert(stage.selection.implementation->name);
        }
    }
    std::string result;
    for (const auto& [obvious, names] : kernels) result += fmt::format("{}: {}\n", obvious, fmt::join(names, ", "));
    return result;
}

Problem convolution(const graph::Parameters& parameters, Storage storage = Storage::f32) {
    Problem problem;
    const graph::Shape in{parameters.in_channels, 32, 48},
        out{parameters.out_channels, 32 / parameters.stride, 48 / parameters.stride};
    problem.node = {graph::Convolution{0, graph::Activation::relu}, {}, out, "convolution"};
    problem.inputs = {test::pixel_layout(in, storage)};
    problem.output = test::pixel_layout(out, storage);
    problem.parameters = &parameters;
    return problem;
}

std::string chosen_for(const graph::Parameters& parameters, const DeviceProfile& profile,
                       Storage storage = Storage::f32) {
    return built_in_selection(convolution(parameters, storage), profile).describe();
}

}  // namespace

TEST_CASE("what GPUs, CPUs and DSPs are given of all networks and filters") {
    const std::string many_work_items = R"(collect: collect
easu: easu
int8: int8 tiled
plain: tiled
pointwise: pointwise, pointwise cells
rcas: rcas
reproject: reproject
resample: resample
resolve: resolve
upsample: upsample
upsample motion: upsample motion
warp: warp
warp sharply: warp sharply
)";
    const std::string vectors = R"(collect: collect lanes
easu: easu cells
int8: int8 in float
plain: direct, winograd
pointwise: pointwise, pointwise cells, pointwise four cells
rcas: rcas strips
reproject: reproject strips
resample: resample strips
resolve: resolve strips
upsample: upsample rows
upsample motion: motion rows
warp: warp, warp blocks
warp sharply: warp lanes
)";
    CHECK(chosen(device(DeviceClass::gpu, 1)) == many_work_items);
    CHECK(chosen(device(DeviceClass::cpu, 16)) == vectors);
    std::string few_work_items = vectors;
    few_work_items.replace(few_work_items.find("int8 in float"), std::strlen("int8 in float"), "int8 streamed");
    CHECK(chosen(device(DeviceClass::dsp, 32)) == few_work_items);
}

TEST_CASE("a convolution's kernel follows from its shape and the device's class") {
    std::mt19937 random(1);
    const DeviceProfile gpu = device(DeviceClass::gpu, 1), cpu = device(DeviceClass::cpu, 16),
                        dsp = device(DeviceClass::dsp, 32), scalar = device(DeviceClass::cpu, 1);
    const graph::Parameters usual = test::random_parameters(20, 16, 3, 1, random),
                            wide = test::random_parameters(20, 16, 5, 1, random),
                            groups = test::random_parameters(20, 16, 3, 1, random, 4),
                            strided = test::random_parameters(20, 16, 3, 1, random, 1, 2);
    graph::Parameters exact = usual;
    exact.avoid_winograd = true;
    for (const DeviceProfile& vectors : {cpu, dsp}) {
        CHECK(chosen_for(usual, vectors).starts_with("winograd"));
        CHECK(chosen_for(wide, vectors).starts_with("direct"));
        CHECK(chosen_for(exact, vectors).starts_with("direct"));
    }
    for (const DeviceProfile& many : {gpu, scalar})
        for (const graph::Parameters& parameters : {usual, wide, exact})
            CHECK(chosen_for(parameters, many).starts_with("tiled"));
    for (const DeviceProfile& any : {gpu, cpu, dsp, scalar})
        for (const graph::Parameters& parameters : {groups, strided})
            CHECK(chosen_for(parameters, any).starts_with("plain"));
}

TEST_CASE("a convolution in whole numbers is by VNNI where there is such a thing") {
    graph::Parameters parameters{20, 16};
    graph::QuantizedWeights& weights = parameters.quantized.emplace();
    weights.weights.assign(parameters.weights_per_set(), 1);
    weights.scales.assign(20, 1);
    weights.biases.assign(20, 0);
    Problem problem = convolution(parameters);
    std::get<graph::Convolution>(problem.node.op).rounds = weights.input;
    DeviceProfile cpu = device(DeviceClass::cpu, 16);
    CHECK(built_in_selection(problem, cpu).describe().starts_with("int8 in float"));
    cpu.vnni = true;
    CHECK(built_in_selection(problem, cpu).describe().starts_with("int8 by VNNI"));
    parameters.groups = 4;
    CHECK(built_in_selection(problem, cpu).implementation->name == "int8");
}

TEST_CASE("what does not fit a device's memory or work-groups is not chosen") {
    std::mt19937 random(1);
    const graph::Parameters usual = test::random_parameters(20, 64, 3, 1, random);
    DeviceProfile gpu = device(DeviceClass::gpu, 1), cpu = device(DeviceClass::cpu, 16);
    gpu.max_work_group_size = 64;
    CHECK(chosen_for(usual, gpu).find("WG_X=8 WG_Y=8") != std::string::npos);
    gpu.max_work_group_size = 32;
    CHECK(chosen_for(usual, gpu).starts_with("plain"));
    cpu.local_memory = 8 << 10;
    CHECK(chosen_for(usual, cpu).starts_with("plain"));
}

TEST_CASE("bfloat16 multiplies where it is asked for, the device has it, and Winograd does not do with less") {
    std::mt19937 random(1);
    const graph::Parameters usual = test::random_parameters(20, 16, 3, 1, random),
                            wide = test::random_parameters(20, 16, 5, 1, random),
                            color = test::random_parameters(20, 3, 5, 1, random);
    graph::Parameters exact = wide;
    exact.avoid_winograd = true;
    DeviceProfile cpu = device(DeviceClass::cpu, 16);
    const auto chosen = [&](const graph::Parameters& parameters, bool asked) {
        Problem problem = convolution(parameters);
        problem.bf16 = asked;
        return built_in_selection(problem, cpu).implementation->name;
    };
    CHECK(chosen(wide, true) == "direct");
    cpu.bf16 = true;
    CHECK(chosen(wide, true) == "bf16");
    CHECK(chosen(wide, false) == "direct");
    CHECK(chosen(color, true) == "direct");
    CHECK(chosen(exact, true) == "direct");
    CHECK(chosen(usual, true) == "winograd");
}

TEST_CASE("half arithmetic is used where the device has it and images are half") {
    std::mt19937 random(1);
    const graph::Parameters usual = test::random_parameters(20, 16, 3, 1, random);
    DeviceProfile gpu = device(DeviceClass::gpu, 1);
    CHECK(chosen_for(usual, gpu, Storage::f16).find("HALF") == std::string::npos);
    gpu.half_arithmetic = true;
    CHECK(chosen_for(usual, gpu, Storage::f16).find("HALF") != std::string::npos);
    CHECK(chosen_for(usual, gpu, Storage::f32).find("HALF") == std::string::npos);
}
