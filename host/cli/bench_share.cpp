#include "cli/bench_share.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "base/error.h"
#include "base/parse.h"
#include "clarus/device.h"
#include "clarus/model.h"
#include "cli/progress.h"
#include "measure/sharing_costs.h"

namespace clarus::cli {
namespace {

using measure::GameTurn;
using measure::SharingCosts;

struct Options {
    std::vector<std::string> models{"fsr1", "enss-s-x2"};
    std::string size = "1920x1080";
    measure::SharingOptions sharing;
};

std::string text_of(const measure::SharingSetup& setup) {
    std::string text = fmt::format("{}, {} slots", name_of(setup.hand_over), setup.slots);
    if (setup.render_share > 0) text += fmt::format(", renders for {:g}", setup.render_share);
    if (setup.games > 1) text += fmt::format(", {} games", setup.games);
    return text;
}

constexpr int kWidth = 32;

void print_head() {
    fmt::print("{:<{}}  {:>7}  {:>20}  {:>8}  {:>20}  {:>7}  {:>8}  {:>6}  {:>6}  {:>7}  {:>7}  {:>7}\n", "", kWidth,
               "latency", "added, from to", "frames/s", "over in-process", "waits", "hands on", "CPU", "of it", "MB",
               "of it", "beside");
    fmt::print("{:<{}}  {:>7}  {:>20}  {:>8}  {:>20}  {:>7}  {:>8}  {:>6}  {:>6}  {:>7}  {:>7}  {:>7}\n", "", kWidth,
               "ms", "ms", "", "from to", "ms", "ms", "ms", "serve", "", "serve", "");
}

constexpr double kMega = 1 << 20;

void print_row(const std::string& name, const GameTurn& turn, const std::string& added, const std::string& ratio,
               const std::string& beside) {
    fmt::print(
        "{:<{}}  {:>7.2f}  {:>20}  {:>8.1f}  {:>20}  {:>7.2f}  {:>8.2f}  {:>6.1f}  {:>6.1f}  {:>7.0f}  {:>7.0f}"
        "  {:>7}\n",
        name, kWidth, 1e3 * turn.latency, added, 1 / turn.period, ratio, 1e3 * turn.wait, 1e3 * turn.hand_over,
        1e3 * (turn.processor + turn.upscaler_processor), 1e3 * turn.upscaler_processor,
        (turn.memory + turn.upscaler_memory) / kMega, turn.upscaler_memory / kMega, beside);
}

std::string spread(std::vector<double> values, double factor, const char* format) {
    const auto [least, most] = std::ranges::minmax(values);
    const auto text = [&](double value) { return fmt::format(fmt::runtime(format), factor * value); };
    return fmt::format("{} ({} {})", text(measure::median(values)), text(least), text(most));
}

void print(const SharingCosts& costs) {
    std::string title = "in-process";
    if (costs.setup.render_share > 0) title += fmt::format(", renders for {:g}", costs.setup.render_share);
    if (costs.setup.games > 1) title += fmt::format(", {} games", costs.setup.games);
    print_row(title, costs.in_process, "", "", "");
    const GameTurn& shared = costs.decoupled;
    const double beside = shared.memory + shared.upscaler_memory - shared.slots - costs.in_process.memory;
    print_row(text_of(costs.setup), shared, spread(costs.latency_added, 1e3, "{:.2f}"),
              spread(costs.throughput_ratio, 1, "{:.3f}"), fmt::format("{:+.0f}", beside / kMega));
    std::fflush(stdout);
}

void bench_share(Options options) {
    const std::optional<Size> output = parse_size(options.size);
    if (!output) fail(ErrorKind::invalid_argument, "--size {}: not WIDTHxHEIGHT, such as 1920x1080", options.size);
    for (const std::string& name : options.models) Model::find(name, 2);
    const std::string device = Device::open(options.sharing.device).profile().name;
    options.sharing.tool = std::filesystem::read_symlink("/proc/self/exe");
    for (const std::string& name : options.models) {
        const Model model = Model::find(name, 2);
        const auto side = [&](int pixels) { return std::max(1, static_cast<int>(pixels / model.scale())); };
        options.sharing.model = name;
        options.sharing.render_size = {side(output->width), side(output->height)};
        std::vector<SharingCosts> results;
        {
            Progress progress("measuring " + name);
            results = measure_sharing(options.sharing, measure::sharing_setups(),
                                      [&](double done) { progress.update(done); });
        }
        fmt::print("{}, {}x{} to {}, on {}\n", name, options.sharing.render_size.width,
                   options.sharing.render_size.height, options.size, device);
        print_head();
        for (const SharingCosts& costs : results) print(costs);
        fmt::print("\n");
    }
}

}  // namespace

void add_bench_share_command(CLI::App& bench) {
    CLI::App& command =
        *bench.add_subcommand("share", "Measure what it costs that game and upscaler are processes of their own");
    const auto options = std::make_shared<Options>();
    command.fallthrough(false);  // the options of `clarus bench` are not for this
    command.add_option("--models", options->models, "Names from `clarus models`, or model files")
        ->type_name("A,B")
        ->delimiter(',')
        ->capture_default_str();
    options->sharing.device = "auto";
    command.add_option("--device", options->sharing.device, "As `upscale --device`")
        ->type_name("SEL")
        ->capture_default_str();
    command.add_option("--size", options->size, "Of the output")->type_name("WxH")->capture_default_str();
    command.add_option("--turns", options->sharing.turns, "Of each way, in turns with games that upscale in-process")
        ->check(CLI::Range(1, 1000))
        ->capture_default_str();
    command.add_option("--frames", options->sharing.frames, "A turn")
        ->check(CLI::Range(1, 100000))
        ->capture_default_str();
    command.footer(
        "Each way has the games beside it that upscale in-process, which took turns with it. latency: from a frame's "
        "being drawn to the game's knowing that it is upscaled, one at a time, of which a fifth are faster. waits: a "
        "game for a free slot, or for "
        "its upscaler. hands on: copies, and says that the frame is ready, or submits it. CPU: of all processes, a "
        "frame. MB: what they occupy, pages that several share by their part; beside: more than in-process, but for "
        "the slots. renders for N: nothing is done before each frame, for N times as long as upscaling takes.\n"
        "Examples:\n"
        "  clarus bench share\n"
        "  clarus bench share --models bicubic --turns 20 --device cpu/1");
    command.callback([options] { bench_share(*options); });
}

}  // namespace clarus::cli
