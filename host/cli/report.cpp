#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "base/parse.h"
#include "cli/commands.h"
#include "cli/comparison.h"
#include "cli/image_folder.h"
#include "cli/output_folder.h"
#include "cli/overwriting.h"
#include "cli/progress.h"
#include "cli/report_pictures.h"
#include "cli/report_traces.h"
#include "cli/run_file.h"
#include "io/file.h"
#include "io/image.h"
#include "io/image_folder.h"
#include "io/json_reader.h"
#include "measure/bench_file.h"
#include "metrics/blocks.h"
#include "metrics/masks.h"
#include "report/page.h"

namespace clarus::cli {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct ReportOptions {
    std::vector<fs::path> benches, results;
    std::vector<std::vector<fs::path>> traces;  // each of one run
    ReferenceOptions reference;
    size_t pictures = 8;
    bool lossless = false;
    std::string title;
    fs::path output = "report.html";
};

void add_views(const ComparedResult& result, const std::string& name, const Pictures& pictures,
               std::span<const Reference> references, Json& sources) {
    for (const fs::path& folder : view_folders(result.folder)) {
        const auto images = io::images_in(folder);
        const auto file_of = [&](size_t index) { return require_image(images, references[index].name, folder); };
        sources.push_back(
            pictures.source(fmt::format("{}: {}", name, folder.filename().string()), "view", file_of, true));
    }
}

/// Refuses a page that would replace what it is made from.
void refuse_overwriting_inputs(const ReportOptions& options, std::span<const Reference> references) {
    TakenFiles taken;
    if (!references.empty()) {
        const fs::path& path = options.reference.sequence.path;
        if (const auto& sequence = references.front().sequence)
            taken.add(path, *sequence);
        else
            for (const auto& [name, file] : io::images_in(path)) taken.add(file, "a reference");
    }
    for (const fs::path& file : options.benches) taken.add(file, "what clarus bench wrote");
    for (const std::vector<fs::path>& run : options.traces)
        for (const fs::path& file : run) taken.add(file, "a trace");
    for (const fs::path& result : options.results) {
        taken.add(run_file(result), "what clarus upscale wrote");
        for (const auto& [name, file] : io::images_in(result)) taken.add(file, "an image of a result");
        for (const fs::path& folder : view_folders(result))
            for (const auto& [name, file] : io::images_in(folder)) taken.add(file, "a picture of a view");
    }
    taken.take("--output", options.output);
}

void add_results(const ReportOptions& options, std::span<const Reference> references, Json& data) {
    const Pictures pictures(references, evenly_spaced(references.size(), options.pictures), options.lossless);
    MaskPictures masks(pictures.indices(), io::read_image_header(references.front().file).size);
    const std::vector<ComparedResult> results =
        compare(options.results, references, options.reference,
                [&](size_t frame, const metrics::Masks& seen) { masks.add(frame, seen); });
    const std::vector<std::string> names = names_of(options.results);

    data["lossless"] = options.lossless;
    data["pictured"] = pictures.indices();
    for (const Reference& reference : references) data["frames"].push_back(reference.name);
    Json sources = Json::array();
    if (const auto& sequence = references.front().sequence) {
        data["render_size"] = {sequence->render_size.width, sequence->render_size.height};
        sources.push_back(
            pictures.source("input", "input", [&](size_t i) { return sequence->frames[references[i].index].color; }));
    }
    Progress progress("encoding pictures");
    for (size_t i = 0; i < results.size(); ++i) {
        const ComparedResult& result = results[i];
        sources.push_back(pictures.source(names[i], "result", [&](size_t frame) { return result.files[frame]; }));
        data["results"].push_back({{"name", names[i]},
                                   {"quality", comparison_json(result, references)},
                                   {"run", read_run(result.folder)},
                                   {"places", worst_places(result, pictures.indices())}});
        progress.update(i + 1, results.size());
    }
    for (size_t i = 0; i < results.size(); ++i) add_views(results[i], names[i], pictures, references, sources);
    sources.push_back(pictures.source("reference", "reference", [&](size_t i) { return references[i].file; }));
    data["masks"] = masks.json();
    data["block"] = metrics::BlockErrors::side;
    data["output_size"] = sources.back()["size"];
    data["sources"] = std::move(sources);
}

void write_report(const ReportOptions& options) {
    std::vector<Reference> references;
    if (!options.results.empty()) references = read_references(options.reference);
    refuse_overwriting_inputs(options, references);
    OutputFolders folders;
    folders.require(folder_of(options.output));
    Json data{{"benches", Json::array()}, {"results", Json::array()}, {"traces", Json::array()}};
    for (const std::vector<fs::path>& run : options.traces) data["traces"].push_back(timeline_of_traces(run));
    const std::vector<std::string> files = names_of(options.benches);
    for (size_t i = 0; i < files.size(); ++i)
        data["benches"].push_back({{"name", files[i]}, {"bench", measure::BenchFile(options.benches[i]).json}});
    if (!options.results.empty()) {
        data["title"] = name_of(options.reference.sequence.path);
        add_results(options, references, data);
    }
    if (!options.title.empty()) data["title"] = options.title;
    const std::string page = report::page(data);
    io::write_file_atomically(options.output, std::as_bytes(std::span(page)));
    fmt::print("{}: {:.1f} MB", options.output.string(), static_cast<double>(page.size()) * 1e-6);
    if (data.contains("frames"))
        fmt::print(", pictures of {} of {} frames", data["pictured"].size(), data["frames"].size());
    fmt::print("\n");
}

}  // namespace

void add_report_command(CLI::App& app) {
    CLI::App& command = *app.add_subcommand("report", "One page to look at: pictures, quality, time, devices");
    const auto options = std::make_shared<ReportOptions>();
    const auto sort_out = [options](const std::vector<fs::path>& paths) {
        for (const fs::path& path : paths)
            (fs::is_directory(path) ? options->results : options->benches).push_back(path);
    };
    command
        .add_option_function<std::vector<fs::path>>("BENCH.json|RESULT_DIR", sort_out,
                                                    "What `clarus bench` wrote, and folders of upscaled images; any "
                                                    "number of either")
        ->type_name("");
    command
        .add_option_function<std::vector<std::string>>(
            "--trace",
            [options](const std::vector<std::string>& runs) {
                for (const std::string& run : runs) {
                    options->traces.emplace_back();
                    for (const std::string_view file : between_commas(run)) options->traces.back().emplace_back(file);
                }
            },
            "A timeline of what `--trace` of render, play, serve or upscale wrote; files of one run together, with "
            "commas. Again for another run")
        ->type_name("FILE[,FILE…]")
        ->expected(1)
        ->take_all();
    CLI::Option& sequence =
        *command
             .add_option("--sequence", options->reference.sequence.path,
                         "What the results were upscaled from, with references; needed where there are results")
             ->type_name("SEQUENCE");
    options->reference.add_to(command);
    command
        .add_option("--pictures", options->pictures,
                    "Pictures of so many frames at most, evenly spaced; figures are of all")
        ->type_name("N")
        ->check(CLI::Range(1, 1000))
        ->capture_default_str();
    command.add_flag("--lossless", options->lossless,
                     "Pictures as PNG, some four times as large, in place of JPEG of quality 95");
    command.add_option("--title", options->title, "The sequence's name where not given")->type_name("TEXT");
    command.add_option("-o,--output", options->output, "The page")->type_name("FILE")->capture_default_str();
    command.footer(
        "The page is one file that needs no network. A result's times are those of report.json in its folder, which\n"
        "`clarus upscale --profile --report` writes; its views are those of `clarus upscale --view`. Masks over the\n"
        "pictures need a sequence with output buffers (clarus render --output-buffers).\n\n"
        "Examples:\n"
        "  clarus upscale sequence --model enss-s-x2 --output enss-s-x2 --profile --report enss-s-x2/report.json\n"
        "  clarus report bicubic enss-s-x2 --sequence sequence -o report.html\n"
        "  clarus report bench.json bicubic enss-s-x2 --sequence sequence -o report.html\n"
        "  clarus report this-machine.json that-machine.json -o devices.html\n"
        "  clarus report --trace game.json,upscaler.json --trace full.json -o timelines.html");
    command.callback([options, &sequence] {
        if (options->results.empty() && options->benches.empty() && options->traces.empty())
            throw CLI::RequiredError("BENCH.json, RESULT_DIR or --trace");
        if (!options->results.empty() && sequence.count() == 0) throw CLI::RequiredError("--sequence");
        write_report(*options);
    });
}

}  // namespace clarus::cli
