#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "base/error.h"
#include "base/json_text.h"
#include "cli/commands.h"
#include "cli/comparison.h"
#include "cli/contact_sheet.h"
#include "cli/image_folder.h"
#include "cli/quality_text.h"
#include "cli/taken_files.h"

namespace clarus::cli {
namespace {

enum class Form { text, json, csv };

struct CompareOptions {
    std::vector<std::filesystem::path> results;
    ReferenceOptions reference;
    ContactSheet sheet;
    Form form = Form::text;
};

/// The index of the frame that the sheet shows.
size_t shown_frame(const ContactSheet& sheet, const std::vector<Reference>& references) {
    const auto shown = std::find_if(references.begin(), references.end(), [&](const Reference& reference) {
        return sheet.frame.empty() || reference.name == sheet.frame;
    });
    if (shown == references.end())
        fail(ErrorKind::invalid_argument, "--sheet-frame {}: there is no reference of that name; the first is {}",
             sheet.frame, references.front().name);
    sheet.check(*shown);
    return static_cast<size_t>(shown - references.begin());
}

void draw_sheet(const ContactSheet& sheet, const std::vector<ComparedResult>& results, const Reference& reference,
                size_t frame) {
    std::vector<SheetColumn> columns;
    for (const ComparedResult& result : results)
        columns.push_back(
            {fmt::format("{}, {:.2f} dB", name_of(result.folder), result.frames[frame].psnr), result.files[frame]});
    columns.push_back({"reference", reference.file});
    sheet.draw(columns, reference);
}

void print_text(const CompareOptions& options, std::span<const NamedQuality> rows,
                std::span<const Reference> references) {
    const bool emphasise = rows.size() > 1 && isatty(STDOUT_FILENO) != 0;
    if (rows.size() == 1)
        fmt::print("{} over {} frames\n", to_text(rows[0].quality), references.size());
    else
        fmt::print("{}", quality_table(rows, emphasise));
    fmt::print("{}", places_tables(rows, emphasise));
    for (const std::string& line : missing_figures(options.results, references, options.reference))
        fmt::print("\n{}\n", line);
}

void print_comparison(const CompareOptions& options) {
    const std::vector<Reference> references = read_references(options.reference);
    const size_t shown = shown_frame(options.sheet, references);
    if (!options.sheet.file.empty()) {
        TakenFiles taken;
        if (references.front().sequence)
            taken.add(options.reference.sequence.path, *references.front().sequence);
        else
            taken.add_folder(options.reference.sequence.path);
        for (const std::filesystem::path& folder : options.results) taken.add_folder(folder);
        taken.take("--sheet", options.sheet.file);
    }
    const std::vector<ComparedResult> results = compare(options.results, references, options.reference);
    std::vector<NamedQuality> rows;
    nlohmann::ordered_json json;
    for (const ComparedResult& result : results) {
        rows.push_back({result.folder.string(), result.quality});
        json.push_back(comparison_json(result, references));
    }
    if (options.form == Form::json)
        fmt::print("{}\n", json_text(json.size() == 1 ? json[0] : json, 2));
    else if (options.form == Form::csv)
        fmt::print("{}", quality_csv(rows));
    else
        print_text(options, rows, references);
    if (!options.sheet.file.empty()) draw_sheet(options.sheet, results, references[shown], shown);
}

}  // namespace

void add_compare_command(CLI::App& app) {
    CLI::App& command = *app.add_subcommand("compare", "How near upscaled frames come to their references");
    const auto options = std::make_shared<CompareOptions>();
    const auto set_folders = [options](std::vector<std::filesystem::path> folders) {
        options->reference.sequence.path = folders.back();
        folders.pop_back();
        options->results = std::move(folders);
    };
    command
        .add_option_function<std::vector<std::filesystem::path>>(
            "FOLDER", set_folders,
            "Folders of upscaled images and, last, their reference: a sequence that has references, or a folder of "
            "images of the same names")
        ->required()
        ->expected(2, -1)
        ->type_name("");
    options->reference.add_to(command);
    options->sheet.add_to(command);
    CLI::Option& json = *command.add_flag_callback(
        "--json", [options] { options->form = Form::json; },
        "Print JSON, with every frame: an object, or a list of them where there are several results");
    command
        .add_flag_callback(
            "--csv", [options] { options->form = Form::csv; }, "Print CSV, a line a result")
        ->excludes(&json);
    command.footer(
        "Both are compared as display values in [0, 1]. PSNR, SSIM, FLIP and VMAF are means over the frames; the "
        "pooled "
        "PSNR\n"
        "is that of the mean squared error over all of them. Two figures are of stability in time, and are there "
        "where\n"
        "the sequence is such that they can be:\n"
        "  IF-SSIM    similarity of consecutive frames, aligned by the renderer's motion, where the reference does "
        "not\n"
        "             change, but not across cuts. It needs motion and depth of output pixels: clarus render\n"
        "             --output-buffers writes them; those of render pixels are not taken in their place\n"
        "  pixel std  temporal standard deviation, in 8-bit levels, of the pixels of static segments: runs of frames\n"
        "             whose references are, bit for bit, that of the frame before\n"
        "STRRED is of both, space and time: 0 where nothing differs.\n\n"
        "More tables are of places; masks are made from the same motion and depth (docs/metrics.md has all "
        "definitions):\n"
        "  disoccl. N    what was hidden or outside the picture in any of the last N frames\n"
        "  thin          what is narrower than two render pixels, and its neighbours\n"
        "  moving        by half a render pixel or more; still: by less than 1/16, and not disoccl. 8\n"
        "  worst 1 %     of all blocks of 48x48 pixels: their pooled PSNR\n"
        "  worse blocks  whose error is larger than the baseline's: of all frames, of moving ones\n\n"
        "Linear sequences are measured in radiance, too: the ratio of means, the mean relative error, and the PSNR of "
        "a PQ\n"
        "encoding that shows 1 at 100 cd/m2.\n\n"
        "Examples:\n"
        "  clarus compare upscaled sequence\n"
        "  clarus compare bicubic fsr2 enss sequence          tables, the best in bold\n"
        "  clarus compare bicubic enss sequence --csv > quality.csv\n"
        "  clarus compare fsr2 enss sequence --baseline bilinear\n"
        "  clarus compare bicubic enss sequence --sheet sheet.png --sheet-frame 0012 --crop 400,200,160,90\n"
        "  clarus compare upscaled sequence/reference --frames :8 --json");
    command.callback([options] { print_comparison(*options); });
}

}  // namespace clarus::cli
