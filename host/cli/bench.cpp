#include "measure/bench.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "base/error.h"
#include "base/parse.h"
#include "base/platform.h"
#include "base/precision.h"
#include "clarus/version.h"
#include "cli/bench_compare.h"
#include "cli/bench_game.h"
#include "cli/bench_placement.h"
#include "cli/bench_share.h"
#include "cli/choice.h"
#include "cli/commands.h"
#include "cli/finite.h"
#include "cli/output_folder.h"
#include "cli/progress.h"
#include "cli/taken_files.h"
#include "measure/bench_file.h"
#include "measure/start.h"

namespace clarus::cli {
namespace {

using measure::BenchResult;
using measure::ItemResult;

struct Options {
    measure::BenchOptions bench;
    std::vector<std::string> sizes, precisions;
    std::filesystem::path output, checks, write_checks;
    Tuning check_tuning = Tuning::obvious;
    bool without_start = false;
};

Size output_size(const std::string& text) {
    for (const auto& [word, size] : {std::pair{"720p", Size{1280, 720}}, {"1080p", {1920, 1080}}, {"4k", {3840, 2160}}})
        if (text == word) return size;
    const std::optional<Size> size = parse_size(text);
    if (!size) throw CLI::ValidationError("--sizes", text + " is none of 720p|1080p|4k, and not like 1080x1200");
    return *size;
}

std::filesystem::path default_output() {
    const auto time = std::chrono::floor<std::chrono::seconds>(std::chrono::system_clock::now());
    return fmt::format("bench-{:%Y-%m-%d-%H%M%S}.json", fmt::localtime(std::chrono::system_clock::to_time_t(time)));
}

void require_place_for(OutputFolders& folders, const std::filesystem::path& file) {
    folders.require(folder_of(file));
    if (!file.has_filename() || std::filesystem::is_directory(file))
        fail(ErrorKind::file, "{} is a folder where a file is to be written", file.string());
}

std::string percent(double share) { return fmt::format("{:.0f} %", 100 * share); }

void print_row(const BenchResult& result, const ItemResult& item, size_t model_width) {
    fmt::print("{:<{}}  {:>10}  {:<4}", item.model, model_width, measure::text_of(item.output_size),
               name_of(item.precision));
    if (!item.score) {
        fmt::print("  no score: {}\n", item.no_score);
        return;
    }
    const measure::Score& score = *item.score;
    const double within = score.latency.relative_interval();
    fmt::print("  {:>9.2f}  {:>8.2f}  {:>6}{}  {:>8.1f}  {:>7}", 1e3 * score.latency.median, 1e3 * score.p95,
               fmt::format("{:.1f} %", 100 * within), score.latency.steady ? " " : "*", score.frames_per_second.median,
               percent(score.roofline_share(result.device_of(item))));
    fmt::print("  {:>7.1f}", static_cast<double>(measure::without_images(*item.memory)) / (1 << 20));
    fmt::print("  {:>6}  {:>6}  {:>6}", item.start ? fmt::format("{:.1f}", item.start->cold) : "-",
               item.start ? fmt::format("{:.2f}", item.start->warm) : "-",
               item.start ? fmt::format("{:.2f}", item.start->other_size) : "-");
    fmt::print("  {}\n", item.check.result == measure::Check::Result::passed ? "ok" : "unchecked");
}

void print_tables(const BenchResult& result) {
    size_t width = 5;
    for (const ItemResult& item : result.items) width = std::max(width, item.model.size());
    bool all_steady = true;
    for (const measure::DeviceResult& device : result.devices) {
        fmt::print("{}  {} ({}, {})\n", device.profile.selector, device.profile.name, device.profile.platform,
                   device.profile.driver_version);
        const auto figure = [](const measure::Figure& of, const char* unit) {
            return fmt::format("{:.1f} {} ± {:.1f} %", 1e-9 * of.median, unit, 100 * of.relative_interval());
        };
        fmt::print("compute peak {}, {}copy bandwidth {}\n\n", figure(device.compute_peak, "GFLOP/s"),
                   device.int8_peak ? fmt::format("of bytes {}, ", figure(*device.int8_peak, "GOP/s")) : "",
                   figure(device.copy_bandwidth, "GB/s"));
        fmt::print("{:<{}}  {:>10}  {:<4}  {:>9}  {:>8}  {:>6}   {:>8}  {:>7}  {:>7}  {:>6}  {:>6}  {:>6}  {}\n",
                   "model", width, "output", "", "ms median", "p95", "±", "frames/s", "of roof", "MiB", "cold s",
                   "warm s", "size s", "image");
        for (const ItemResult& item : result.items) {
            if (item.device != device.profile.selector) continue;
            print_row(result, item, width);
            all_steady = all_steady && (!item.score || item.score->latency.steady);
        }
        fmt::print("\n");
    }
    if (!all_steady)
        fmt::print(
            "* The time was spent before the median was known to {:g} %: something else kept the machine busy, "
            "or its clock changed.\n",
            100 * measure::kSteadyWithin);
}

/// How the speed went under sustained load: the first and the last fifth of the turns.
void print_throttling(const ItemResult& item) {
    constexpr size_t kParts = 5;
    if (!item.score || item.score->turns.size() < kParts) return;
    const std::vector<measure::TurnResult>& turns = item.score->turns;
    const size_t part = turns.size() / kParts;
    std::vector<double> first, last;
    for (size_t i = 0; i < part; ++i) {
        first.push_back(turns[i].latency);
        last.push_back(turns[turns.size() - part + i].latency);
    }
    const measure::Figure begin = measure::summarise(first), end = measure::summarise(last);
    const measure::Ratio ratio = measure::ratio(begin, end);
    const std::string interval = !measure::median_ranks(part) ? "too few turns to tell how surely"
                                                              : fmt::format("{:.3f} to {:.3f}", ratio.low, ratio.high);
    fmt::print("{} over {:.0f} s: {:.2f} ms in the first fifth, {:.2f} ms in the last: {:.3f} times ({})\n", item.model,
               turns.back().at - turns.front().at, 1e3 * begin.median, 1e3 * end.median, ratio.value, interval);
}

std::vector<measure::BenchItem> items_of(Options& options) {
    for (const std::string& size : options.sizes) options.bench.sizes.push_back(output_size(size));
    for (const std::string& name : options.precisions) options.bench.precisions.push_back(parse_precision(name));
    return measure::bench_items(options.bench);
}

void write_checks(Options& options) {
    OutputFolders folders;
    require_place_for(folders, options.write_checks);
    measure::Checks checks;
    if (std::filesystem::exists(options.write_checks)) checks = measure::Checks::read(options.write_checks);
    const std::vector<measure::BenchItem> items = items_of(options);
    Progress progress("computing");
    for (size_t i = 0; i < items.size(); ++i) {
        if (measure::add_check(checks, items[i], options.check_tuning)) checks.write(options.write_checks);
        progress.update(i + 1, items.size());
    }
}

void bench(Options& options) {
    const std::filesystem::path output = options.output.empty() ? default_output() : options.output;
    OutputFolders folders;
    require_place_for(folders, output);
    TakenFiles taken;
    for (const std::string& model : options.bench.models) taken.add(model, "a model");
    if (!options.checks.empty()) taken.add(options.checks, "the expected images");
    taken.take("--output", output);
    const std::filesystem::path unfinished = output.string() + ".part";
    taken.take("--output", unfinished);
    if (std::filesystem::exists(unfinished)) static_cast<void>(measure::BenchFile(unfinished));  // a run that was ended
    options.bench.checks = measure::Checks::read(options.checks.empty() ? measure::shipped_checks() : options.checks);
    options.bench.version = CLARUS_VERSION_STRING;
    if (!options.without_start) options.bench.tool = std::filesystem::read_symlink("/proc/self/exe");
    const std::vector<measure::BenchItem> items = items_of(options);
    options.bench.interim = [&](const BenchResult& result) { result.write(unfinished); };
    const BenchResult result = [&] {
        Progress progress("measuring");
        return measure::run_bench(options.bench, items, [&](double done) { progress.update(done); });
    }();
    result.write(output);
    std::filesystem::remove(unfinished);
    print_tables(result);
    if (result.profile == measure::Profile::sustained)
        for (const ItemResult& item : result.items) print_throttling(item);
    fmt::print("{} written after {:.0f} s\n", output.string(), result.seconds);
    const auto without =
        std::count_if(result.items.begin(), result.items.end(), [](const ItemResult& item) { return !item.score; });
    if (without > 0)
        fail(ErrorKind::device, "{} of {} have no score; the table and {} say why", without, result.items.size(),
             output.string());
}

/// What measure::measure_start runs.
void add_first_frame_command(CLI::App& bench) {
    CLI::App& command = *bench.add_subcommand("first-frame", "Upscale a frame: what a start is measured by");
    const auto first = std::make_shared<measure::FirstFrame>();
    command.group("");  // of no use to others
    command.fallthrough(false);
    command.add_option("DEVICE", first->device)->required();
    command.add_option("MODEL", first->model)->required();
    command.add_option("SCALE", first->scale)->required();
    command.add_option("WIDTH", first->render_size.width)->required();
    command.add_option("HEIGHT", first->render_size.height)->required();
    add_choice<Precision, Precision>(command, "PRECISION", first->precision,
                                     {{"fp32", Precision::fp32}, {"fp16", Precision::fp16}, {"bf16", Precision::bf16}},
                                     "");
    add_choice<Tuning, Tuning>(command, "TUNING", first->tuning, {{"stored", Tuning::stored}, {"fixed", Tuning::fixed}},
                               "");
    command.callback([first] {
        end_with_parent(getppid());
        const int programs = measure::show_first_frame(*first);
        fmt::print("{} {}\n", measure::kFirstFrameWord, programs);
        std::fflush(stdout);
    });
}

}  // namespace

void add_bench_command(CLI::App& app) {
    CLI::App& command = *app.add_subcommand("bench", "Measure models on devices; `bench compare` compares results");
    const auto options = std::make_shared<Options>();
    measure::BenchOptions& bench_options = options->bench;
    command.add_option("-o,--output", options->output, "The result: bench-DATE.json here by default")
        ->type_name("FILE");
    using measure::Profile;
    add_choice<Profile, Profile>(
        command, "--profile", bench_options.profile,
        {{"quick", Profile::quick}, {"full", Profile::full}, {"sustained", Profile::sustained}},
        "quick by default: every model at its smallest scale, 1080p. full: all of them at the papers' sizes and every "
        "precision, for hours on a processor. sustained: one model for minutes, to see a device slow down");
    command
        .add_option("--devices", bench_options.devices,
                    "auto, gpu, cpu, an index or a part of a name each; all but simulators by default")
        ->type_name("A,B")
        ->delimiter(',');
    command.add_option("--models", bench_options.models, "Names from `clarus models`, or model files")
        ->type_name("A,B")
        ->delimiter(',');
    command.add_option("--sizes", options->sizes, "Of the output: 720p, 1080p, 4k or any other, 1080x1200")
        ->type_name("A,B")
        ->delimiter(',');
    command.add_option("--precision", options->precisions, "Of fp32, fp16, bf16; what the device lacks is left out")
        ->type_name("A,B")
        ->delimiter(',');
    command
        .add_option("--seconds", bench_options.seconds,
                    "At most so long for one model's turns; 6 in quick, 20 in full, 180 in sustained by default")
        ->type_name("S")
        ->check(CLI::PositiveNumber)
        ->check(finite());
    CLI::Option* const tuning = add_choice<Tuning, Tuning>(
        command, "--tuning", bench_options.tuning,
        {{"stored", Tuning::stored}, {"measure", Tuning::measure}, {"fixed", Tuning::fixed}},
        "Choose kernels by what was measured here before, by measuring first, or by what comes with "
        "Clarus alone");
    command.add_flag("--without-start", options->without_start,
                     "Leave out cold and warm starts, which take new processes that compile everything");
    command.add_option("--checks", options->checks, "The expected images, in place of those that are shipped")
        ->type_name("FILE");
    command
        .add_option(
            "--write-checks", options->write_checks,
            "Measure nothing: compute the expected images of these models and sizes in fp32, on the first device, and "
            "add to FILE what it lacks. By the obvious kernels, which take hours for large networks, unless --tuning "
            "names others")
        ->type_name("FILE");
    command.footer(
        "Examples:\n"
        "  clarus bench\n"
        "  clarus bench --devices gpu,cpu --models enss-s-x2,fsr1 --sizes 1080p,4k --precision fp32,fp16 -o both.json\n"
        "  clarus bench --profile sustained --models enss-l-x2 --seconds 600\n"
        "  clarus bench compare before.json after.json\n"
        "  clarus bench placement --devices \"cpu/1, cpu/1=dsp\" --model srpo-x2\n"
        "  clarus bench share --models enss-s-x2");
    add_bench_compare_command(command);
    add_bench_placement_command(command);
    add_bench_share_command(command);
    add_bench_game_command(command);
    add_first_frame_command(command);
    command.callback([&command, tuning, options] {
        if (!command.get_subcommands().empty()) return;
        if (tuning->count() > 0) options->check_tuning = options->bench.tuning;
        options->write_checks.empty() ? bench(*options) : write_checks(*options);
    });
}

}  // namespace clarus::cli
