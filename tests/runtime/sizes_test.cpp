// Sizes are arguments: what a kernel is told of its tensors, and that another size compiles nothing.

#include <doctest/doctest.h>

#include <bit>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <set>
#include <string>
#include <vector>

#include "api/build_graph.h"
#include "clarus/model.h"
#include "model_file.h"
#include "pipelines/pipeline.h"
#include "runtime/inputs.h"
#include "runtime/launch.h"
#include "runtime/plan.h"
#include "runtime/tuner.h"
#include "temporary_folder.h"
#include "test_device.h"

using namespace clarus;
using runtime::TensorArgument;

namespace {

/// The programs of a model at a size, as a device of this class would run it.
std::set<std::string> programs_of(const Model& model, Size render, const DeviceProfile& profile, int band_rows = 0) {
    runtime::PlanOptions options;
    options.band_rows = band_rows;
    const Size output = output_size(render, model.scale());
    const auto plan = runtime::make_plan(
        build_graph(model, render, output), options, profile,
        [&](const runtime::Problem& problem) { return runtime::built_in_selection(problem, profile); });
    std::set<std::string> programs;
    const auto add = [&](const runtime::KernelCall& call) { programs.insert(runtime::program_key(call)); };
    for (const runtime::PlannedStage& stage : plan->stages) {
        add(stage.lowered.call);
        if (stage.lowered.packing && !stage.lowered.packing->on_host) add(stage.lowered.packing->call);
    }
    add(runtime::ingest(plan->ingest));
    add(runtime::present(plan->layout.layouts[plan->layout.graph.output], options));
    return programs;
}

std::vector<std::filesystem::path> shipped_models() {
    std::vector<std::filesystem::path> files;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(CLARUS_MODEL_DIR))
        if (entry.path().extension() == ".safetensors") files.push_back(entry.path());
    return files;
}

std::vector<DeviceProfile> classes() {
    DeviceProfile gpu, cpu;
    gpu.device_class = DeviceClass::gpu;
    cpu.device_class = DeviceClass::cpu;
    cpu.float_vector_width = 16;
    for (DeviceProfile* profile : {&gpu, &cpu}) {
        profile->memory_alignment = 128;
        profile->max_work_group_size = 256;
        profile->local_memory = 512 << 10;
        profile->half_storage = true;
    }
    return {gpu, cpu};
}

void check_same_programs(const std::set<std::string>& programs, const std::set<std::string>& others) {
    for (const std::string& program : others) {
        if (!programs.contains(program)) MESSAGE(program);
        CHECK(programs.contains(program));
    }
}

}  // namespace

TEST_SUITE("small") {
    TEST_CASE("the device lays out what a kernel is told as the host does") {
        ocl::Context& context = test_device().context();
        const cl::Program program = context.program_from_source("sizes", R"(
            kernel __attribute__((reqd_work_group_size(1, 1, 1))) void read(Sizes given, global uint* out) {
                TAKE(sizes);
                out[0] = sizeof(Sizes);
                out[1] = sizes->first_item;
                out[2] = sizes->B.width;
                out[3] = sizes->B.height;
                out[4] = sizes->B.row;
                out[5] = sizes->B.offset;
                out[6] = sizes->B.ring;
                out[7] = sizes->B.reciprocal;
                out[8] = sizes->phases;
                out[9] = as_uint(sizes->scale);
            })",
                                                                "-DTENSORS=A,B -DNUMBERS=INT(phases)FLOAT(scale)");
        struct {
            cl_int first_item = 7;
            TensorArgument a{1, 2, 3, 4, 5, 6}, b{10, 20, 30, 40, 50, 60};
            cl_int phases = 3;
            cl_float scale = 2.5f;
        } const sizes;
        const std::vector<cl_uint> expected{sizeof sizes, 7, 10, 20, 30, 40, 50, 60, 3, std::bit_cast<cl_uint>(2.5f)};
        std::vector<cl_uint> result(expected.size());
        const size_t bytes = result.size() * sizeof(cl_uint);
        const cl::Buffer out(context.context(), CL_MEM_WRITE_ONLY, bytes);
        cl::Kernel kernel(program, "read");
        kernel.setArg(0, sizeof sizes, &sizes);
        kernel.setArg(1, out);
        context.queue().enqueueNDRangeKernel(kernel, cl::NullRange, cl::NDRange(1), cl::NDRange(1));
        context.queue().enqueueReadBuffer(out, CL_TRUE, 0, bytes, result.data());
        CHECK(result == expected);
    }
}

TEST_CASE("a ring's rows are numbered by the remainder") {
    for (int ring = 2; ring < 700; ++ring) {
        runtime::TensorLayout layout;
        layout.in_ring = true;
        layout.ring = ring;
        const TensorArgument argument = runtime::argument_for(layout);
        for (std::uint32_t row = 0; row < (1 << 16); row += row < 2000 ? 1 : 97) {
            const auto quotient = static_cast<std::uint32_t>((std::uint64_t{row} * argument.reciprocal) >> 32);
            if (row - quotient * ring != row % ring) FAIL("row ", row, " of a ring of ", ring);
        }
    }
}

TEST_CASE("another size asks for no other programs, of any shipped model, whole or in bands") {
    for (const std::filesystem::path& file : shipped_models()) {
        const Model model = Model::load(file.string());
        for (const DeviceProfile& profile : classes())
            for (const int band_rows : {0, 16}) {
                CAPTURE(file.filename().string());
                CAPTURE(band_rows);
                const std::set<std::string> programs = programs_of(model, {960, 540}, profile, band_rows);
                for (const Size other : {Size{480, 272}, {719, 405}, {961, 541}})
                    check_same_programs(programs, programs_of(model, other, profile, band_rows));
            }
    }
}

TEST_CASE("another real scale asks for no other programs") {
    // As where an engine renders fewer pixels for the same output.
    const auto at = [](double scale) { return Size{static_cast<int>(1920 / scale), static_cast<int>(1080 / scale)}; };
    for (const DeviceProfile& profile : classes()) {
        for (const pipelines::FilterPipeline& filter : pipelines::filters()) {
            const std::string name(filter.name);
            CAPTURE(name);
            const std::set<std::string> programs = programs_of(Model::filter(name, 2), at(2), profile);
            for (const double scale : {1.0, 1.5, 2.3456, 3.0, 12.5})
                check_same_programs(programs, programs_of(Model::filter(name, scale), at(scale), profile));
        }
        {
            const TemporaryFolder folder;
            ModelFile file = ModelFile::read(std::string(CLARUS_GOLDEN_DIR) + "/nss_x2.model.safetensors");
            file.header["__metadata__"]["scale"] = "any";
            const std::filesystem::path path = folder / "model.safetensors";
            file.write(path);
            const std::set<std::string> programs = programs_of(Model::load(path.string(), 2), at(2), profile);
            // All of them ratios of small numbers: at others NSS has another kernel, for rows without a period.
            for (const double scale : {1.5, 2.4, 3.0})
                check_same_programs(programs, programs_of(Model::load(path.string(), scale), at(scale), profile));
        }
    }
}
