#include <fmt/format.h>

#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "base/error.h"
#include "base/precision.h"
#include "clarus/device.h"
#include "clarus/model.h"
#include "clarus/upscaler.h"
#include "cli/choice.h"
#include "cli/commands.h"
#include "cli/progress.h"

namespace clarus::cli {
namespace {

struct PrepareOptions {
    std::vector<std::string> models, devices{"auto"}, precisions{"fp32"};
    bool all = false;
};

// What is compiled does not depend on the size; a frame of this one is soon made.
constexpr Size kRenderSize{480, 270};

/// How many programs were compiled. A device's programs are shared by its models, and only what is new in one would be
/// kept: opened for each, it keeps what a process needs that begins with that model.
int programs_of(const std::string& selector, const std::string& name, Precision precision) {
    const Device device = Device::open(selector);
    UpscalerOptions options;
    options.precision = precision;
    Progress progress("compiling " + name);
    Upscaler upscaler(device, Model::find(name), kRenderSize, options);
    upscaler.prepare([&](double fraction) { progress.update(fraction); });
    return device.programs_compiled();
}

void prepare(const std::string& selector, const std::string& name, Precision precision) {
    const auto start = std::chrono::steady_clock::now();
    const int programs = programs_of(selector, name, precision);
    const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
    if (programs > 0 && programs_of(selector, name, precision) > 0)
        fail(ErrorKind::file,
             "what was compiled of {} for {} is not kept: every start compiles it again. A warning says why, or there "
             "is no home folder; CLARUS_CACHE_DIR names a folder to keep it in",
             name, selector);
    fmt::print("{} {} on {}: {}\n", name, name_of(precision), Device::open(selector).profile().name,
               programs == 0 ? "was there" : fmt::format("compiled in {:.1f} s", seconds.count()));
}

void run(const PrepareOptions& options) {
    std::vector<Precision> precisions;
    for (const std::string& name : options.precisions) precisions.push_back(parse_precision(name));
    const std::vector<std::string> models = options.all ? Model::names() : options.models;
    for (const std::string& name : models) static_cast<void>(Model::find(name));  // before anything is compiled
    for (const std::string& selector : options.devices)
        for (const std::string& name : models)
            for (const Precision precision : precisions) prepare(selector, name, precision);
}

}  // namespace

void add_prepare_command(CLI::App& app) {
    CLI::App& command =
        *app.add_subcommand("prepare", "Compile models ahead, for installers: later first frames are quick");
    const auto options = std::make_shared<PrepareOptions>();
    CLI::Option* models = command.add_option("models", options->models, "Names from `clarus models`, or model files");
    CLI::Option* all = command.add_flag("--all", options->all, "Every model and filter that `clarus models` lists");
    models->excludes(all);
    command
        .add_option("--device", options->devices, "auto, gpu, cpu, an index or a part of a name each; auto by default")
        ->type_name("A,B")
        ->delimiter(',');
    command.add_option("--precision", options->precisions, "Of fp32, fp16, bf16; fp32 by default")
        ->type_name("A,B")
        ->delimiter(',');
    command.footer(
        "What is compiled serves every size. It is kept in the user's own caches: the driver's, or Clarus's\n"
        "($CLARUS_CACHE_DIR). The small program that reads and writes a caller's pixel formats is compiled when they "
        "are\n"
        "known.\n\n"
        "Examples:\n"
        "  clarus prepare enss-s-x2 enss-m-x2\n"
        "  clarus prepare --all --device gpu,cpu --precision fp32,fp16");
    command.callback([options] {
        if (options->models.empty() && !options->all) throw CLI::ValidationError("models", "name some, or say --all");
        run(*options);
    });
}

}  // namespace clarus::cli
