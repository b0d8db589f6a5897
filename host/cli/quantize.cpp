#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "api/build_graph.h"
#include "base/error.h"
#include "cli/calibration.h"
#include "cli/commands.h"
#include "cli/finite.h"
#include "cli/output_folder.h"
#include "cli/progress.h"
#include "cli/sequence_options.h"
#include "cli/taken_files.h"
#include "io/safetensors_writer.h"
#include "io/temporary_folder.h"

namespace clarus::cli {
namespace {

namespace fs = std::filesystem;

struct QuantizeOptions {
    std::string model;
    std::vector<fs::path> sequences;
    SequenceOptions reading;  // of each
    fs::path output;
    std::vector<std::string> keep;
    std::optional<double> percentile;
    std::string device = "auto";
};

constexpr double kTriedPercentiles[] = {100, 99.999, 99.99, 99.9};
constexpr double kPercentilesOfLayers[] = {100, 99.999, 99.997, 99.99, 99.97, 99.9, 99.7, 99};
constexpr Size kSmall{8, 8};  // of a graph that is looked at only

using Layers = std::map<std::string, std::shared_ptr<const graph::Parameters>>;

/// The model's convolutions by name, with their weights as they are multiplied.
Layers layers_of(const Model& model) {
    const graph::Graph graph = build_graph(model, kSmall, output_size(kSmall, model.scale()));
    Layers layers;
    for (const graph::Node& node : graph.nodes)
        if (const auto* convolution = std::get_if<graph::Convolution>(&node.op))
            if (const auto& parameters = graph.parameters[convolution->parameters]; !parameters->layer.empty())
                layers[parameters->layer] = parameters;
    return layers;
}

std::string names_of(const Layers& layers) {
    std::vector<std::string> names;
    for (const auto& [name, parameters] : layers) names.push_back(name);
    return fmt::format("{}", fmt::join(names, ", "));
}

Model float_model(const std::string& name) {
    Model model = Model::find(name);
    if (!model.tensors())
        fail(ErrorKind::invalid_argument, "{} is a filter; only networks can be quantized (`clarus models`)", name);
    for (const auto& [tensor, content] : model.tensors()->tensors())
        if (content.type == io::DataType::i8)
            fail(ErrorKind::invalid_argument, "{} is quantized already: its tensor {} is in whole numbers", name,
                 tensor);
    return model;
}

Layers chosen_layers(const Model& model, const std::vector<std::string>& keep) {
    Layers layers = layers_of(model);
    if (layers.empty()) fail(ErrorKind::invalid_argument, "{} has no convolution that can be quantized", model.name());
    const std::string names = names_of(layers);
    for (const std::string& name : keep)
        if (layers.erase(name) == 0)
            fail(ErrorKind::invalid_argument, "--keep {}: {} has no such layer, or it is named twice; there are: {}",
                 name, model.name(), names);
    if (layers.empty())
        fail(ErrorKind::invalid_argument, "--keep keeps all layers of {}: nothing is left to quantize", model.name());
    for (const auto& [name, parameters] : layers)
        if (parameters->sets == 0)
            fail(ErrorKind::invalid_argument,
                 "{}: layer {} is made by a perceptron for each jitter, and can only stay in floating point: --keep {}",
                 model.name(), name, name);
    return layers;
}

std::vector<CalibrationSequence> read_sequences(const QuantizeOptions& options, const Model& model) {
    std::vector<CalibrationSequence> result;
    for (const fs::path& path : options.sequences) {
        SequenceOptions reading = options.reading;
        reading.path = path;
        result.push_back({path.string(), reading.read(model.scale())});
        if (result.back().sequence.scale != model.scale())
            fail(ErrorKind::invalid_argument, "model {} upscales by {}, but the sequence {} is made for {}",
                 model.name(), model.scale(), path.string(), result.back().sequence.scale);
    }
    return result;
}

void check_output(const QuantizeOptions& options, const Model& model,
                  const std::vector<CalibrationSequence>& sequences) {
    if (fs::is_directory(options.output))
        fail(ErrorKind::file, "{} is a folder where a file is to be written", options.output.string());
    TakenFiles taken;
    taken.add(model.tensors()->path(), "the model");
    for (const CalibrationSequence& each : sequences) taken.add(each.path, each.sequence);
    taken.take("--output", options.output);
}

/// A quantized model file in the making.
class QuantizedFile {
  public:
    QuantizedFile(const Model& model, const Layers& layers) : metadata_(model.metadata()) {
        metadata_["quantization"] = "int8";
        const bool has_tables =
            std::any_of(layers.begin(), layers.end(), [](const auto& layer) { return layer.second->conditioned; });
        for (const auto& [name, tensor] : model.tensors()->tensors()) {
            const bool replaced = name.ends_with(".weight") && layers.contains(name.substr(0, name.rfind('.')));
            // No perceptron makes whole numbers: the table serves all jitters.
            if (replaced || (has_tables && name.starts_with("mlp."))) continue;
            tensors_[name] = io::NewTensor::of(tensor.type, tensor.shape, tensor.bytes);
        }
    }

    void put(const std::string& name, const graph::Parameters& layer, const graph::QuantizedWeights& weights) {
        std::vector<int64_t> channels{layer.out_channels};
        if (layer.conditioned) channels.insert(channels.begin(), layer.sets);
        std::vector<int64_t> shape = channels;
        for (const int extent : {layer.in_channels / layer.groups, layer.kernel, layer.kernel}) shape.push_back(extent);
        const auto add = [&](const char* tensor, io::DataType type, const std::vector<int64_t>& extents,
                             const auto& values) {
            tensors_[name + tensor] = io::NewTensor::of(type, extents, std::span(values));
        };
        add(".weight", io::DataType::i8, shape, weights.weights);
        add(".weight_scale", io::DataType::f32, channels, weights.scales);
        add(".bias", io::DataType::i32, channels, weights.biases);
        add(".input_scale", io::DataType::f32, {1}, std::vector{weights.input.scale});
        add(".input_zero_point", io::DataType::i32, {1}, std::vector{weights.input.zero_point});
    }

    void write(const fs::path& path) const { io::write_safetensors(path, metadata_, tensors_); }

  private:
    std::map<std::string, std::string> metadata_;
    std::map<std::string, io::NewTensor> tensors_;
};

using Samples = std::map<std::string, LayerSamples>;
/// Of what each layer reads.
using Inputs = std::map<std::string, graph::Quantization>;

/// One way to choose them, and what it is called.
struct Candidate {
    std::string name;
    Inputs inputs;
};

std::vector<Candidate> candidates(const Samples& samples, const std::optional<double>& percentile) {
    std::vector<double> percentiles(std::begin(kTriedPercentiles), std::end(kTriedPercentiles));
    if (percentile) percentiles = {*percentile};
    std::vector<Candidate> result;
    for (const double percent : percentiles) {
        Candidate& candidate = result.emplace_back(Candidate{fmt::format("{:g} % of samples", percent), {}});
        for (const auto& [name, read] : samples) candidate.inputs[name] = quantization_of(read, percent);
    }
    if (percentile) return result;
    Candidate& closest = result.emplace_back(Candidate{"each layer's least error", {}});
    for (const auto& [name, read] : samples) closest.inputs[name] = closest_quantization(read, kPercentilesOfLayers);
    return result;
}

using Quantizers = std::map<std::string, WeightQuantizer>;

QuantizedFile quantized(const Model& model, const Layers& layers, const Quantizers& quantizers, const Inputs& inputs) {
    QuantizedFile file(model, layers);
    for (const auto& [name, parameters] : layers)
        file.put(name, *parameters, quantizers.at(name).weights(inputs.at(name)));
    return file;
}

void print_inputs(const Inputs& inputs) {
    fmt::print("{:<32} {:>10} {:>10} {:>11}\n", "layer", "reads from", "to", "in steps of");
    for (const auto& [name, input] : inputs)
        fmt::print("{:<32} {:>10.4f} {:>10.4f} {:>11.6f}\n", name, -input.scale * input.zero_point,
                   input.scale * (255 - input.zero_point), input.scale);
}

void quantize(const QuantizeOptions& options) {
    const Model model = float_model(options.model);
    const Layers layers = chosen_layers(model, options.keep);
    std::vector<CalibrationSequence> sequences = read_sequences(options, model);
    check_output(options, model, sequences);
    OutputFolders folders;
    folders.require(folder_of(options.output));

    const Calibration calibration(Device::open(options.device), std::move(sequences));
    calibration.check(model);
    std::map<std::string, int> kernels;
    for (const auto& [name, parameters] : layers) kernels[name] = parameters->kernel;
    const auto with_progress = [](const std::string& label, const auto& work) {
        Progress progress(label);
        return work([&](size_t frame, size_t frames) { progress.update(frame, frames); });
    };
    const auto samples = with_progress(
        "looking at layers", [&](const auto& progress) { return calibration.samples(model, kernels, progress); });
    const auto outputs = [&](const Model& of, const std::string& label) {
        return with_progress(label, [&](const auto& progress) { return calibration.outputs(of, progress); });
    };
    const Calibration::Outputs wanted = outputs(model, "upscaling in floating point");

    Quantizers quantizers;
    with_progress("preparing layers", [&](const auto& progress) {
        for (const auto& [name, parameters] : layers) {
            progress(quantizers.size(), layers.size());
            quantizers.emplace(name, WeightQuantizer(*parameters, samples.at(name)));
        }
    });

    const io::TemporaryFolder scratch;
    const fs::path file = scratch.path() / (model.name() + ".safetensors");
    Candidate best;
    double best_psnr = -1;
    fmt::print("{}: {} layers in int8\n", model.name(), layers.size());
    for (const Candidate& candidate : candidates(samples, options.percentile)) {
        quantized(model, layers, quantizers, candidate.inputs).write(file);
        const Calibration::Outputs made = outputs(Model::load(file.string()), "upscaling with " + candidate.name);
        const double psnr = Calibration::psnr(made, wanted);
        fmt::print("  {:>24}: {:.2f} dB from the floating-point model\n", candidate.name, psnr);
        if (psnr <= best_psnr) continue;
        best = candidate;
        best_psnr = psnr;
    }
    print_inputs(best.inputs);
    quantized(model, layers, quantizers, best.inputs).write(options.output);
    fmt::print("{}: with {}\n", options.output.string(), best.name);
}

}  // namespace

void add_quantize_command(CLI::App& app) {
    CLI::App& command = *app.add_subcommand("quantize", "Make a model's convolutions compute in int8");
    const auto options = std::make_shared<QuantizeOptions>();
    command.add_option("MODEL", options->model, "A shipped model's name (clarus models), or a file")->required();
    command
        .add_option("SEQUENCE", options->sequences,
                    "Sequences' folders or JSON: of what the model is for, and none that it will be judged by")
        ->required();
    command.add_option("-o,--output", options->output, "The quantized model, a .safetensors file")
        ->type_name("FILE")
        ->required();
    command
        .add_option("--keep", options->keep,
                    "Layers that stay in floating point, as their tensors are called; names that it does not know are "
                    "answered with all there are")
        ->type_name("A,B")
        ->delimiter(',');
    command
        .add_option("--percentile", options->percentile,
                    "Layers read what is within so many per cent of the samples; by default 100, 99.999, 99.99, 99.9 "
                    "and what is best for each layer are tried, and what changes the output least is taken")
        ->type_name("P")
        ->check(CLI::Range(50.0, 100.0))
        ->check(finite());
    options->reading.add_to(command);
    command.add_option("--device", options->device, "auto; gpu, cpu or dsp; an index, 0:1; a part of a name")
        ->type_name("SEL");
    command.footer(
        "The float model is run over the sequences, and what its convolutions read decides how numbers are rounded.\n"
        "What is computed, and what is in the file: docs/quantization.md.\n\n"
        "Examples:\n"
        "  clarus quantize srpo-x2 train/one train/two -o srpo-x2-int8.safetensors\n"
        "  clarus quantize enss-s-x2 train/one train/two -o enss-s-x2-int8.safetensors --keep first\n"
        "  clarus upscale sequence --model enss-s-x2-int8.safetensors --output upscaled");
    command.callback([options] { quantize(*options); });
}

}  // namespace clarus::cli
