#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "api/build_graph.h"
#include "base/error.h"
#include "cli/calibration.h"
#include "cli/commands.h"
#include "cli/output_folder.h"
#include "cli/overwriting.h"
#include "cli/progress.h"
#include "cli/sequence_options.h"
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

QuantizedFile quantized(const Model& model, const Layers& layers, const std::map<std::string, LayerSamples>& samples,
                        double percentile) {
    QuantizedFile file(model, layers);
    for (const auto& [name, parameters] : layers) {
        const LayerSamples& read = samples.at(name);
        file.put(name, *parameters, quantized_weights(*parameters, read, quantization_of(read, percentile)));
    }
    return file;
}

void print_layers(const Layers& layers, const std::map<std::string, LayerSamples>& samples, double percentile) {
    fmt::print("{:<32} {:>10} {:>10} {:>11}\n", "layer", "reads from", "to", "in steps of");
    for (const auto& [name, parameters] : layers) {
        const graph::Quantization input = quantization_of(samples.at(name), percentile);
        fmt::print("{:<32} {:>10.4f} {:>10.4f} {:>11.6f}\n", name, -input.scale * input.zero_point,
                   input.scale * (255 - input.zero_point), input.scale);
    }
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
    std::set<std::string> names;
    for (const auto& [name, parameters] : layers) names.insert(name);
    const auto with_progress = [](const std::string& label, const auto& work) {
        Progress progress(label);
        return work([&](size_t frame, size_t frames) { progress.update(frame, frames); });
    };
    const auto samples = with_progress(
        "looking at layers", [&](const auto& progress) { return calibration.samples(model, names, progress); });
    const auto outputs = [&](const Model& of, const std::string& label) {
        return with_progress(label, [&](const auto& progress) { return calibration.outputs(of, progress); });
    };
    const Calibration::Outputs wanted = outputs(model, "upscaling in floating point");

    std::vector<double> percentiles(std::begin(kTriedPercentiles), std::end(kTriedPercentiles));
    if (options.percentile) percentiles = {*options.percentile};
    const io::TemporaryFolder scratch;
    double best = 0, best_psnr = -1;
    fmt::print("{}: {} layers in int8 that read what is within\n", model.name(), layers.size());
    for (const double percentile : percentiles) {
        const fs::path file = scratch.path() / (model.name() + ".safetensors");
        quantized(model, layers, samples, percentile).write(file);
        const Calibration::Outputs made =
            outputs(Model::load(file.string()), fmt::format("upscaling with {:g} %", percentile));
        const double psnr = Calibration::psnr(made, wanted);
        fmt::print("  {:>7g} % of samples: {:.2f} dB from the floating-point model\n", percentile, psnr);
        if (psnr <= best_psnr) continue;
        best = percentile;
        best_psnr = psnr;
    }
    print_layers(layers, samples, best);
    quantized(model, layers, samples, best).write(options.output);
    fmt::print("{}: with {:g} %\n", options.output.string(), best);
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
                    "Layers read what is within so many per cent of the samples; unless told, 100, 99.999, 99.99 and "
                    "99.9 are tried, and the one that changes the output least is taken")
        ->type_name("P")
        ->check(CLI::Range(50.0, 100.0));
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
