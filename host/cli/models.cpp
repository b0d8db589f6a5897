#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <utility>

#include "base/error.h"
#include "base/json_text.h"
#include "clarus/model.h"
#include "cli/commands.h"
#include "cli/pipeline_options.h"
#include "cli/taken_files.h"
#include "io/safetensors_writer.h"

namespace clarus::cli {
namespace {

const char* name_of(io::DataType type) {
    switch (type) {
        case io::DataType::f32:
            return "f32";
        case io::DataType::f16:
            return "f16";
        case io::DataType::i8:
            return "i8";
        case io::DataType::i32:
            break;
    }
    return "i32";
}

std::string scale_text(const Model& model) {
    const ScaleRange scales = model.scales();
    if (scales.is_single()) return fmt::format("{:g}", model.scale());
    return std::isinf(scales.largest) ? "any" : fmt::format("{:g}-{:g}", scales.smallest, scales.largest);
}

/// What frames are to have. Jitter is Halton's unless told.
std::string_view wants(const Model& model) {
    static const std::map<std::string_view, std::string_view> of_pipelines = {
        {"clarus", "colour, depth, motion, jitter"}, {"enss", "colour, depth, motion, jitter"},
        {"nsrr", "colour, depth, motion, jitter"},   {"nss", "colour, depth, motion, jitter"},
        {"fsr2", "colour, depth, motion, jitter"},   {"mnss", "colour, depth, motion, MNSS's jitter"},
        {"srpo", "colour, aliased, without jitter"}, {"stack", "colour, antialiased, without jitter"},
    };
    const auto found = of_pipelines.find(model.pipeline());
    return found == of_pipelines.end() ? "colour" : found->second;
}

nlohmann::ordered_json to_json(const Model& model) {
    const ScaleRange scales = model.scales();
    auto options = nlohmann::ordered_json::array();
    for (const PipelineOption& option : model.options())
        options.push_back({{"name", option.name},
                           {"help", option.help},
                           {"smallest", option.smallest},
                           {"largest", option.largest},
                           {"default", option.usual}});
    nlohmann::ordered_json json = {
        {"name", model.name()}, {"pipeline", model.pipeline()}, {"smallest_scale", scales.smallest}};
    json["largest_scale"] =
        std::isinf(scales.largest) ? nlohmann::ordered_json() : nlohmann::ordered_json(scales.largest);
    json["wants"] = wants(model);
    json["parameters"] = model.tensors() ? model.tensors()->elements() : 0;
    json["file"] =
        model.tensors() ? nlohmann::ordered_json(model.tensors()->path().string()) : nlohmann::ordered_json();
    json["metadata"] = model.metadata();
    json["options"] = std::move(options);
    return json;
}

void print_models_as_json() {
    auto list = nlohmann::ordered_json::array();
    for (const std::string& name : Model::names()) {
        try {
            list.push_back(to_json(Model::find(name)));
        } catch (const Error& error) {
            list.push_back({{"name", name}, {"error", error.what()}});
        }
    }
    fmt::print("{}\n", json_text(list, 2));
}

void print_models() {
    constexpr std::string_view kRow = "{:<18}  {:<10}  {:>5}  {:>12}  {}\n";
    fmt::print(fmt::runtime(kRow), "model", "pipeline", "scale", "parameters", "wants");
    for (const std::string& name : Model::names()) {
        try {
            const Model model = Model::find(name);
            const io::Safetensors* tensors = model.tensors();
            fmt::print(fmt::runtime(kRow), name, model.pipeline(), scale_text(model), tensors ? tensors->elements() : 0,
                       wants(model));
        } catch (const Error& error) {
            fmt::print("{:<18}  {}\n", name, error.what());
        }
    }
    fmt::print(
        "\nWhich first: clarus-m, at any scale; enss-s-x2 where time is short; fsr2 without a network. With colour "
        "alone\n"
        "espcn-x2, of aliased frames srpo-x2. What each gains and costs: docs/choosing-a-model.md\n");
    fmt::print("\noptions of pipelines, for clarus upscale\n");
    for (const PipelineFlag& flag : pipeline_flags()) fmt::print("  {:<18}  {}\n", flag.flag, flag.help);
}

void print_options(const Model& model) {
    if (model.options().empty()) return;
    fmt::print("\noptions\n");
    for (const PipelineOption& option : model.options())
        fmt::print("  {}: {}; {}, {:g} by default\n", option.name, option.help, option.range(), option.usual);
}

/// As a file that is read where ONNX is not.
void write_model(const std::string& name_or_path, const std::filesystem::path& file) {
    const Model model = Model::find(name_or_path);
    if (!model.tensors())
        fail(ErrorKind::invalid_argument, "{} is a filter, of which there is no model file", model.name());
    if (file.extension() != ".safetensors")
        fail(ErrorKind::invalid_argument, "--output {}: a model file's name ends in .safetensors", file.string());
    TakenFiles taken;
    taken.add(model.tensors()->path(), "the model");
    taken.take("--output", file);
    std::map<std::string, io::NewTensor> tensors;
    for (const auto& [name, tensor] : model.tensors()->tensors())
        tensors[name] = io::NewTensor::of(tensor.type, tensor.shape, tensor.bytes);
    io::write_safetensors(file, model.metadata(), tensors);
}

void print_model(const std::string& name) {
    const Model model = Model::find(name);
    fmt::print("{}: pipeline {}, scale {}\n", model.name(), model.pipeline(), scale_text(model));
    const io::Safetensors* tensors = model.tensors();
    if (!tensors) {
        fmt::print("A filter; --scale may be any number from 1.\n");
        print_options(model);
        return;
    }
    if (!model.scales().is_single())
        fmt::print("--scale may be any number from {:g} to {:g}; it is the sequence's by default.\n",
                   model.scales().smallest, model.scales().largest);
    fmt::print("file: {}\n\nmetadata\n", tensors->path().string());
    for (const auto& [key, value] : model.metadata()) fmt::print("  {}: {}\n", key, value);
    print_options(model);
    fmt::print("\ntensors\n");
    for (const auto& [tensor_name, tensor] : tensors->tensors())
        fmt::print("  {:<16}  {}  [{}]\n", tensor_name, name_of(tensor.type), fmt::join(tensor.shape, ", "));
    fmt::print("\n{} parameters\n", tensors->elements());
}

}  // namespace

void add_models_command(CLI::App& app) {
    CLI::App& command =
        *app.add_subcommand("models", "List the shipped models and the filters, and the options they have");
    command.footer(
        "Models are also looked for in the folders that CLARUS_MODEL_PATH names, separated by ':'.\n\n"
        "Examples:\n  clarus models\n  clarus models --json | jq -r '.[].name'");
    const auto as_json = std::make_shared<bool>(false);
    command.add_flag(
        "--json", *as_json,
        "A list for programs: name, pipeline, smallest and largest scale (null: any), what frames are to have "
        "(wants), parameters, file, metadata, options");
    command.callback([as_json] { *as_json ? print_models_as_json() : print_models(); });
}

void add_model_command(CLI::App& app) {
    CLI::App& command = *app.add_subcommand("model", "Show a model's metadata and tensors");
    const auto name = std::make_shared<std::string>();
    const auto output = std::make_shared<std::string>();
    command.add_option("FILE", *name, "A model file, .safetensors or .onnx, or a name from `clarus models`")
        ->required();
    command.add_option(
        "-o,--output", *output,
        "Write it as a .safetensors file: of a network in ONNX form, for programs that do not read ONNX");
    command.footer(
        "Examples:\n  clarus model enss-s-x2\n  clarus model trained/enss-m.safetensors\n"
        "  clarus model net.onnx -o net.safetensors");
    command.callback([name, output] { output->empty() ? print_model(*name) : write_model(*name, *output); });
}

}  // namespace clarus::cli
