#include "cli/bench_placement.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "base/error.h"
#include "base/parse.h"
#include "cli/output_folder.h"
#include "cli/placement_options.h"
#include "cli/progress.h"
#include "cli/taken_files.h"
#include "io/file.h"
#include "measure/device_json.h"
#include "measure/placements.h"
#include "measure/timeline.h"
#include "report/page.h"

namespace clarus::cli {
namespace {

struct Options {
    std::string devices, model;
    std::string size = "1920x1080";
    std::string placement = "auto";
    int turns = 7, streams = 1;
    std::filesystem::path output;
};

/// A page with a timeline of each placement.
void draw(const Options& options, const Model& model, const std::vector<DeviceProfile>& devices,
          const std::vector<measure::PlacementResult>& results) {
    nlohmann::ordered_json data{{"title", fmt::format("{} to {} on several devices", model.name(), options.size)}};
    nlohmann::ordered_json selectors = nlohmann::ordered_json::array();
    for (const DeviceProfile& device : devices) selectors.push_back(measure::to_json(device));
    for (const measure::PlacementResult& result : results)
        data["placements"].push_back({{"name", result.name},
                                      {"seconds", result.period},
                                      {"devices", selectors},
                                      {"placement", measure::placement_json(result.parts)},
                                      {"stages", measure::stages_json(result.stages)},
                                      {"timeline", measure::timeline_json(result.stages)}});
    const std::string page = report::page(data);
    io::write_file_atomically(options.output, std::as_bytes(std::span(page)));
    fmt::print("{}\n", options.output.string());
}

void bench_placement(const Options& options) {
    const std::optional<Size> output = parse_size(options.size);
    if (!output) fail(ErrorKind::invalid_argument, "--size {}: not WIDTHxHEIGHT, such as 1920x1080", options.size);
    const Device devices = Device::open(options.devices);
    const Model model = Model::find(options.model, 2);
    const auto side = [&](int pixels) { return std::max(1, static_cast<int>(pixels / model.scale())); };
    OutputFolders folders;
    if (!options.output.empty()) {
        TakenFiles taken;
        taken.add(options.model, "the model");
        taken.take("--output", options.output);
        folders.require(folder_of(options.output));
    }
    std::vector<measure::PlacementResult> results;
    {
        Progress progress("measuring placements");
        const bool is_named = options.placement == "auto" || options.placement == "all";
        results = measure::measure_placements(devices, model, {side(output->width), side(output->height)},
                                              {.every_cut = options.placement == "all",
                                               .rules = is_named ? "" : placement_rules(options.placement),
                                               .turns = options.turns,
                                               .streams = options.streams,
                                               .profiles = !options.output.empty()},
                                              [&](double done) { progress.update(done); });
    }
    const std::vector<DeviceProfile> profiles = devices.profiles();
    for (size_t device = 0; device < profiles.size(); ++device)
        fmt::print("{}  {}  {}\n", device, profiles[device].selector, profiles[device].name);
    fmt::print("\n{} to {}, frames in host memory\n", model.name(), options.size);
    const std::string together = options.streams == 1 ? "" : fmt::format("{} streams      fair  ", options.streams);
    fmt::print("{:>9}  {:>9}  {:>9}  {}{:>6}  {:>8}  {}\n", "alone, ms", "each, ms", "/ all on 0", together, "parts",
               "MB moved", "placement");
    for (const measure::PlacementResult& result : results) {
        double moved = 0;
        for (const PlacedPart& part : result.parts) moved += 1e-6 * static_cast<double>(part.bytes_in);
        fmt::print("{:>9.2f}  {:>9.2f}  {:>10.3f}  ", 1e3 * result.latency, 1e3 * result.period, result.period_ratio);
        if (options.streams > 1) fmt::print("{:>9.3f}  {:>8.3f}  ", result.together_ratio, result.fairness);
        fmt::print("{:>6}  {:>8.2f}  {}\n", result.parts.size(), moved, result.name);
    }
    if (!options.output.empty()) draw(options, model, profiles, results);
}

}  // namespace

void add_bench_placement_command(CLI::App& bench) {
    CLI::App& command =
        *bench.add_subcommand("placement", "Measure how several devices share one model, and several streams devices");
    const auto options = std::make_shared<Options>();
    command
        .add_option("--devices", options->devices,
                    "Two or more selectors between commas, as `upscale --device`; with --streams, also one")
        ->type_name("SEL,…")
        ->required();
    command.add_option("--model", options->model, "A name from `clarus models`, or a model file")->required();
    command.add_option("--size", options->size, "Of the output")->type_name("WxH")->capture_default_str();
    command
        .add_option("--placement", options->placement,
                    "auto: each device alone, and what auto chooses; all: every cut in two as well; rules, as "
                    "`upscale --place`, or a file of them: those as well")
        ->type_name("auto|all|RULES")
        ->capture_default_str();
    command
        .add_option("--streams", options->streams,
                    "Also run so many streams at once: seconds from frame to frame of all of them together, over "
                    "those of one that is all on 0; and how fair their turns are: the first that has done its frames, "
                    "over the last")
        ->check(CLI::Range(1, 64))
        ->capture_default_str();
    command.add_option("--turns", options->turns, "Of each placement, in turns with all on device 0")
        ->check(CLI::Range(1, 1000))
        ->capture_default_str();
    command
        .add_option("-o,--output", options->output,
                    "Also write a page with a timeline of both devices for each placement")
        ->type_name("FILE");
    command.footer(
        "Examples:\n"
        "  clarus bench placement --devices \"gpu, cpu\" --model mnss-x2\n"
        "  clarus bench placement --devices \"cpu/1, cpu/1=dsp\" --model srpo-x2 --placement all "
        "-o placements.html\n"
        "  clarus bench placement --devices \"cpu/1, cpu/1=dsp\" --model mnss-x2-int8 --placement "
        "\"*convolution*=dsp\" --streams 2\n"
        "  clarus bench placement --devices gpu --model enss-s-x2 --streams 10");
    command.callback([options] { bench_placement(*options); });
}

}  // namespace clarus::cli
