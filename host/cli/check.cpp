#include "check/check.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "base/error.h"
#include "base/json_text.h"
#include "cli/check_correction.h"
#include "cli/check_page.h"
#include "cli/commands.h"
#include "cli/output_folder.h"
#include "cli/progress.h"
#include "cli/sequence_options.h"
#include "cli/taken_files.h"
#include "io/file.h"

namespace clarus::cli {
namespace {

constexpr size_t most_frames = 32;  // that are looked at unless --frames names others
constexpr size_t pixels = 4000;     // compared of a pair of frames

struct CheckOptions {
    SequenceOptions sequence;
    double scale = 2;
    bool json = false, fix = false;
    std::filesystem::path report;
};

/// How many columns a terminal gives it: bytes that continue a character of UTF-8 take none.
size_t width_of(const std::string& text) {
    return static_cast<size_t>(std::ranges::count_if(text, [](char byte) { return (byte & 0xC0) != 0x80; }));
}

void print_table(const std::vector<std::vector<std::string>>& rows) {
    std::vector<size_t> widths(rows.front().size());
    for (const auto& row : rows)
        for (size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], width_of(row[i]));
    for (const auto& row : rows) {
        std::string line;
        for (size_t i = 0; i < row.size(); ++i)
            line += row[i] + std::string(i + 1 < row.size() ? widths[i] - width_of(row[i]) + 2 : 0, ' ');
        fmt::print("{}\n", line.substr(0, line.find_last_not_of(' ') + 1));
    }
}

void print_text(const check::Judgement& judgement, const io::Sequence& sequence) {
    std::vector<std::vector<std::string>> rows{{"field", "declared", "fits best", "dB", "", "frames", ""}};
    for (const check::Finding& one : judgement.findings)
        rows.push_back({one.field, one.declared, one.best, one.gain > 0 ? fmt::format("{:.1f}", one.gain) : "–",
                        one.verdict == check::Verdict::wrong ? "WRONG" : check::word(one.verdict), frames_of(one),
                        one.note});
    if (sequence.frames.size() == 1)
        fmt::print("1 frame, {}\n\n", sequence.frames.front().name);
    else
        fmt::print("{} frames, {} to {}\n\n", sequence.frames.size(), sequence.frames.front().name,
                   sequence.frames.back().name);
    print_table(rows);
    const auto wrong = std::ranges::count(judgement.findings, check::Verdict::wrong, &check::Finding::verdict);
    fmt::print("\n{}\n", wrong == 0   ? "Nothing is surely wrong."
                         : wrong == 1 ? "One thing is surely wrong."
                                      : fmt::format("{} things are surely wrong.", wrong));
}

void print_json(const check::Judgement& judgement, const io::Sequence& sequence) {
    nlohmann::ordered_json findings = nlohmann::ordered_json::array();
    for (const check::Finding& one : judgement.findings)
        findings.push_back({{"field", one.field},
                            {"declared", one.declared},
                            {"best", one.best},
                            {"gain_db", one.gain},
                            {"verdict", check::word(one.verdict)},
                            {"agree", one.agree},
                            {"count", one.count},
                            {"against", one.against},
                            {"note", one.note}});
    const nlohmann::ordered_json json{
        {"wrong", judgement.is_wrong()}, {"frames", sequence.frames.size()}, {"findings", std::move(findings)}};
    fmt::print("{}\n", json_text(json, 2));
}

int check_conventions(const CheckOptions& options) {
    io::Sequence sequence = options.sequence.read(options.scale);
    if (options.sequence.frames.is_all() && sequence.frames.size() > most_frames) sequence.frames.resize(most_frames);
    io::check_sequence(sequence, false, false);
    TakenFiles taken;
    taken.add(options.sequence.path, sequence);
    OutputFolders folders;
    if (!options.report.empty()) {
        taken.take("--report", options.report);
        folders.require(folder_of(options.report));
    }
    const std::filesystem::path corrected = corrected_name(options.sequence.path);
    if (options.fix) require_correctable(options.sequence.path, corrected);

    check::Film film;
    check::Evidence evidence;
    {
        Progress progress("checking");
        constexpr double reading = 0.4;  // of the work
        film = check::Film::read(sequence, [&](size_t frames) {
            progress.update(reading * static_cast<double>(frames) / static_cast<double>(sequence.frames.size()));
        });
        evidence =
            check::measure(film, pixels, [&](double fraction) { progress.update(reading + (1 - reading) * fraction); });
    }
    const check::Judgement judgement = check::judge(evidence, sequence);
    if (options.json)
        print_json(judgement, sequence);
    else
        print_text(judgement, sequence);
    if (options.fix && judgement.is_wrong())
        for (const std::string& line :
             write_correction(options.sequence.path, corrected, judgement.correction, options.sequence.frames.first))
            if (!options.json) fmt::print("{}\n", line);
    if (!options.report.empty()) {
        const std::string page = check_page(film, evidence, judgement, options.sequence.path);
        io::write_file_atomically(options.report, std::as_bytes(std::span(page)));
        if (!options.json) fmt::print("{}\n", options.report.string());
    }
    return judgement.is_wrong() ? 1 : 0;
}

}  // namespace

void add_check_command(CLI::App& app) {
    CLI::App& command = *app.add_subcommand("check", "Whether a sequence holds what its JSON says");
    const auto options = std::make_shared<CheckOptions>();
    command.add_option("SEQUENCE", options->sequence.path, "The sequence's folder or JSON")->required();
    options->sequence.add_to(command);
    command.add_option("--scale", options->scale, "Which ratio of an NSS capture")
        ->type_name("S")
        ->capture_default_str();
    command
        .add_option("--report", options->report,
                    "A page: the previous frame warped on to the present one, vectors, jitter")
        ->type_name("FILE");
    command.add_flag("--fix", options->fix,
                     "Write a corrected JSON beside the sequence's, NAME.fixed.json; nothing is replaced");
    command.add_flag("--json", options->json, "The table as JSON");
    command.footer(fmt::format(
        "Previous frames are warped on to the present ones in all the ways that conventions can differ, and what fits\n"
        "best is held against what is declared: motion's unit, direction, y, axes, frame, jitter inside or not;\n"
        "jitter's signs, axes, frame; depth's encoding, direction, planes, frame; the colour space; the order of\n"
        "frames. Of longer sequences the first {} frames, unless --frames names others. docs/checking.md has the\n"
        "method, and what cannot be told of some scenes.\n\n"
        "Exit status: 0 nothing is surely wrong, 1 something is (or the check could not be made: then an error says\n"
        "why), 2 wrong usage.\n\n"
        "Examples:\n"
        "  clarus check my-sequence\n"
        "  clarus check my-sequence --report check.html\n"
        "  clarus check my-sequence --fix && echo right\n"
        "  clarus check my-sequence --frames 100:132 --json",
        most_frames));
    command.callback([options] {
        if (const int status = check_conventions(*options); status != 0) throw FoundWrong{};
    });
}

}  // namespace clarus::cli
