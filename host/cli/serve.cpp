#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/error.h"
#include "base/explain.h"
#include "base/log.h"
#include "base/memory.h"
#include "base/rounding.h"
#include "cli/choice.h"
#include "cli/commands.h"
#include "cli/control_server.h"
#include "cli/frame_loop.h"
#include "cli/interrupt.h"
#include "cli/output_folder.h"
#include "cli/pipeline_options.h"
#include "cli/placement_options.h"
#include "cli/progress.h"
#include "cli/serving.h"
#include "cli/shared_output.h"
#include "cli/shared_source.h"
#include "cli/supervisor.h"
#include "cli/taken_files.h"
#include "cli/trace.h"
#include "cli/video_output.h"
#include "link/link.h"

namespace clarus::cli {
namespace {

struct ServeOptions {
    std::string name;
    Serving::Settings settings{.wish = {}, .device = "auto", .upscaler = {}, .only_size = {}};
    std::string output, listen;
    int png_compression = 1;
    std::optional<int> crf;
    std::filesystem::path trace;
    bool goes_on = false, restarts = false;
};

void tell_waiting(const std::string& name) {
    if (isatty(STDERR_FILENO)) fmt::print(stderr, "waiting for a renderer that shares {}; Ctrl-C ends\n", name);
}

/// Where frames go that keep their size; each or none.
struct Sinks {
    VideoOutput* video;
    SharedOutput* shared;
};

void upscale(const ServeOptions& options, const OutputTarget& target, const Sinks& sinks, SharedSource& source,
             Serving& serving, OutputFolders& folders) {
    const Upscaler& first = serving.upscaler();
    const Size render = first.render_size(), shown = first.output_size();
    const ColorSpace color_space = source.stream()->sequence.color_space;
    if (!target.folder.empty())
        folders.require(target.folder, uintmax_t{3} * sizeof(float) * shown.width * shown.height);
    fmt::print("{}: {} at {}x{}, to {}x{}\n", options.name, options.settings.wish.model, render.width, render.height,
               shown.width, shown.height);
    if (const std::vector<std::string>& unread = source.stream()->unread; !unread.empty())
        fmt::print("{}: no model reads {}, which the stream has\n", options.name, fmt::join(unread, ", "));
    std::fflush(stdout);
    const bool linear = color_space == ColorSpace::linear;
    const FrameOutput output{.folder = target.folder,
                             .extension = linear ? ".exr" : ".png",
                             .type = linear ? io::SampleType::f32 : io::SampleType::u8,
                             .color_space = color_space,
                             .views = {},
                             .view_size = {},
                             .measure = false,
                             .interpolated = false,
                             .png_compression = options.png_compression,
                             .fallback = options.settings.upscaler.fallback,
                             .video = target.video,
                             .writer = sinks.video,
                             .shared = sinks.shared};
    Trace trace(!options.trace.empty());
    bool is_first = true;
    uint64_t next_number = 0;
    const auto choose = [&](SourceFrame& frame) {
        if (!target.folder.empty() && frame.number < next_number)
            log(LogLevel::warning, "frame {} follows frame {}: pictures of these numbers in {} are replaced",
                frame.number, next_number - 1, target.folder.string());
        next_number = frame.number + 1;
        if (sinks.video && is_first)
            sinks.video->open({.size = shown, .frame_rate = 1 / frame.seconds, .crf = options.crf});
        is_first = false;
        return serving.choose(frame);
    };
    upscale_frames(source, choose, nullptr, output, frames_under_way(first, output), trace, [](const FrameResult&) {});
    if (!options.trace.empty()) trace.write(options.trace);
}

void serve(const ServeOptions& options) {
    share_one_heap();  // models may change for as long as it runs
    std::optional<link::Address> address;
    if (!options.listen.empty()) address = link::parse_address(options.listen, "--listen");
    const OutputTarget target = output_target(options.output, Source::stream);
    Serving::Settings settings = options.settings;
    settings.keeps_size = target.is_video() || !target.shared.empty();
    SharedSource source(options.name, options.goes_on);
    Serving serving(options.name, source, std::move(settings));
    source.on_connection([&serving] {
        Progress progress("preparing");
        serving.meet([&](double fraction) {
            if (Interrupt::came()) fail(ErrorKind::file, "interrupted while the model was prepared");
            progress.update(fraction);
        });
    });
    if (options.restarts && !target.video.empty())
        fail(ErrorKind::invalid_argument,
             "--restart: a video cannot be gone on with; give --output a folder, and make a video of its pictures");
    check_crf(options.crf, target);
    OutputFolders folders;
    if (!target.folder.empty()) folders.require(target.folder);
    TakenFiles taken;
    taken.add(options.settings.wish.model, "the model");
    for (const auto& [option, file] : {std::pair("--output", target.video), {"--trace", options.trace}}) {
        if (file.empty()) continue;
        taken.take(option, file);
        folders.require(folder_of(file));
    }
    const Interrupt interrupt;
    std::optional<VideoOutput> video;
    if (target.is_video()) video.emplace(target);
    std::optional<SharedOutput> shared;
    if (!target.shared.empty()) shared.emplace(target.shared);
    const ControlServer control(options.name,
                                [&](const nlohmann::json& changes, const ControlServer::Progress& progress) {
                                    if (!changes.empty()) serving.change(changes, progress);
                                    return serving.state();
                                });
    const std::unique_ptr<link::Link> link = address ? link::receive_frames(options.name, *address) : nullptr;
    try {
        tell_waiting(options.name);
        const Sinks sinks{video ? &*video : nullptr, shared ? &*shared : nullptr};
        if (source.connect()) upscale(options, target, sinks, source, serving, folders);
        if (video) video->finish();
        if (shared) shared->finish();
    } catch (const std::exception& error) {
        source.refuse(explain(error));
        if (video) video->keep();
        throw;
    }
    const SharedSource::Figures figures = source.figures();
    fmt::print("{} frames, {} skipped; {:.2f} ms a frame, {:.1f} a second\n", figures.frames, figures.skipped,
               figures.milliseconds, figures.frames_per_second);
}

}  // namespace

void add_serve_command(CLI::App& app) {
    CLI::App& command = *app.add_subcommand("serve", "Upscale the frames that a renderer shares, as they come");
    const auto options = std::make_shared<ServeOptions>();
    ModelWish& wish = options->settings.wish;
    UpscalerOptions& settings = options->settings.upscaler;
    command.add_option("NAME", options->name, "Of the renderer's stream, which may come later")->required();
    command
        .add_option("--model", wish.model,
                    "A shipped model's or filter's name (clarus models), or a file, .safetensors or .onnx")
        ->required();
    command
        .add_option("-o,--output", options->output,
                    "Folder for the images, named by the renderer's numbers of frames; those of the same name are "
                    "replaced. Or a video, .mp4, .mkv or .webm, which is there once the stream has ended. Or, as "
                    "moq:https://HOST:PORT/NAME, a relay of Media-over-QUIC, to which PyPI's moq-rs publishes, in the "
                    "python3 in the path; with #SHA256 after it, of the one certificate that the relay may have. "
                    "Or, as ring:OTHER, a stream OTHER, from which the next stage takes the frames: another "
                    "clarus serve, or any reader. Without, nothing is written")
        ->type_name("DIR|FILE|moq:URL|ring:OTHER");
    add_video_options(command, options->crf);
    command
        .add_option("--device", options->settings.device,
                    "auto; gpu, cpu or dsp; an index, 0:1; a part of a name; with /N, a sub-device of N units; with "
                    "=CLASS, taken as one of that class; several between commas")
        ->type_name("SEL");
    command.add_option("--scale", wish.scale, "In place of the renderer's, for models of any scale (clarus models)")
        ->type_name("S");
    command
        .add_option_function<std::string>(
            "--output-size", [&wish](const std::string& text) { wish.output_size = parse_output_size(text); },
            "What the model makes is resampled to it, to a quarter to four times along each axis")
        ->type_name("WxH");
    add_placement_options(command, settings);
    add_pipeline_options(command, settings.pipeline_options);
    add_precision_option(command, settings.precision);
    command
        .add_option("--sharpen", settings.sharpen,
                    "Sharpen what the model shows, last, by MNSS's filter; 0.15 where no strength is given")
        ->type_name("BETA")
        ->expected(0, 1)
        ->default_str("0.15");
    command
        .add_option(
            "--listen", options->listen,
            "Take the frames of a renderer on another machine (`--share ucx:HOST:PORT/NAME`, `clarus relay`) at "
            "this machine's address HOST; PORT alone: from this machine. For networks that are trusted: "
            "nothing is encrypted, and nobody is asked who he is")
        ->type_name("HOST:PORT");
    command.add_option("--png-compression", options->png_compression, "Of PNG files, from 0, none, to 9")
        ->type_name("LEVEL")
        ->check(CLI::Range(0, 9))
        ->capture_default_str();
    command
        .add_option("--trace", options->trace,
                    "Write a Chrome trace of all frames at the end (chrome://tracing, ui.perfetto.dev)")
        ->type_name("FILE");
    command.add_flag("--keep", options->goes_on,
                     "When the renderer closes its stream, wait for the next; without, that ends the command. One that "
                     "dies is waited for in any case");
    command.add_flag("--restart", options->restarts,
                     "Upscale in a process of its own, and in another one where that dies, of a fault in a device's "
                     "driver for instance: the renderer goes on, the next frame begins without history");
    command.footer(
        "Ctrl-C ends it. `clarus control NAME` tells how it goes, and changes the model while it runs.\n"
        "Examples:\n"
        "  clarus serve game --model enss-m-x2 --output upscaled\n"
        "  clarus serve game --model enss-m-x2 --output game.mp4\n"
        "  clarus serve game --model enss-s-x2 --output moq:https://127.0.0.1:4443/game#5f0c…\n"
        "  clarus serve game --model enss-s-x2 --output ring:big  for clarus serve big --model fsr1 --output big.mp4\n"
        "  clarus play sequence --share game --frame-rate 30      in another terminal\n"
        "  clarus control game model=fsr2                         in a third\n"
        "  clarus serve game --model fsr1 --listen 10.0.0.2:7788  for a game on another machine");
    command.callback([options] {
        if (options->restarts) go_on_supervised("clarus serve " + options->name);
        serve(*options);
    });
}

}  // namespace clarus::cli
