#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <future>
#include <iterator>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "base/error.h"
#include "base/log.h"
#include "base/parse.h"
#include "base/rounding.h"
#include "cli/checkpoints.h"
#include "cli/choice.h"
#include "cli/commands.h"
#include "cli/convention_watch.h"
#include "cli/finite.h"
#include "cli/frame_loop.h"
#include "cli/frame_source.h"
#include "cli/interrupt.h"
#include "cli/model_choice.h"
#include "cli/output_folder.h"
#include "cli/overwriting.h"
#include "cli/pipeline_options.h"
#include "cli/placement_options.h"
#include "cli/progress.h"
#include "cli/resume.h"
#include "cli/run_report.h"
#include "cli/run_state.h"
#include "cli/sequence_facts.h"
#include "cli/sequence_options.h"
#include "cli/trace.h"
#include "cli/video_output.h"
#include "cli/video_source.h"
#include "io/described.h"
#include "io/frames.h"
#include "io/image_folder.h"
#include "io/video_reader.h"

namespace clarus::cli {
namespace {

enum class Format { png, exr };
enum class Alpha { keep, drop };
enum class FrameRate { as_rendered, doubled };

const std::vector<std::string> only_list{"list"};  // --view list

struct UpscaleOptions {
    SequenceOptions sequence;
    ModelWish wish;
    std::string output;
    std::string device = "auto";
    UpscalerOptions settings;  // but for what the sequence says
    std::optional<Format> format;
    std::optional<int> bits;
    std::optional<Alpha> alpha;
    int png_compression = 1;
    std::optional<int> crf;
    FrameRate frame_rate = FrameRate::as_rendered;
    std::vector<std::string> views;
    bool explain_placement = false, no_check = false;
    bool print_profile = false;
    std::filesystem::path trace, report;
    bool resume = false;
    std::optional<double> save_every;
};

Format output_format(const UpscaleOptions& options, const OutputTarget& target, ColorSpace color_space) {
    if (!target.video.empty() && (options.format || !options.views.empty()))
        fail(ErrorKind::invalid_argument, "{} is of pictures; name a folder as --output, in place of {}",
             options.format ? "--format" : "--view", target.video.string());
    const bool linear = color_space == ColorSpace::linear, is_picture = !target.picture.empty();
    const Format named = io::extension_of(target.picture) == ".exr" ? Format::exr : Format::png;
    if (is_picture && options.format.value_or(named) != named)
        fail(ErrorKind::invalid_argument, "--format is another than that of --output {}; leave it out",
             target.picture.string());
    const Format format = is_picture ? named : options.format.value_or(linear ? Format::exr : Format::png);
    if (linear && format == Format::png && target.video.empty())
        fail(ErrorKind::invalid_argument, "the sequence {} is linear HDR, which a PNG file cannot hold; {}",
             options.sequence.path.string(), is_picture ? "name an .exr file" : "use --format exr");
    return format;
}

/// Errors: invalid_argument for what one picture cannot hold, and in a folder whose run would take it for its own.
void check_picture(const UpscaleOptions& options, const OutputTarget& target, size_t frames) {
    const char* const more = options.frame_rate == FrameRate::doubled ? "--frame-rate x2"
                             : !options.views.empty()                 ? "--view"
                             : options.resume                         ? "--resume"
                             : options.save_every                     ? "--save-every"
                                                                      : nullptr;
    if (more)
        fail(ErrorKind::invalid_argument, "{} writes more than a picture; name a folder as --output, in place of {}",
             more, target.picture.string());
    if (frames != 1)
        fail(ErrorKind::invalid_argument,
             "--output {} is one picture, and {} frames would be made; name a folder, or one frame: --frames 0:1",
             target.picture.string(), frames);
    if (exists(run_state_file(target.folder)))
        fail(ErrorKind::invalid_argument,
             "--output {} would lie in a folder whose frames `clarus upscale --resume` goes on with; name another "
             "folder",
             target.picture.string());
}

/// As exact as colour is, by default. Errors: invalid_argument for bits that the format has not.
io::SampleType output_type(const std::optional<int>& bits, Format format, const OutputTarget& target,
                           io::SampleType color) {
    if (bits && target.is_video() && *bits != 8 && *bits != 10)
        fail(ErrorKind::invalid_argument, "a video holds 8 or 10 bits, not --bits {}; name a folder, in place of {}",
             *bits, target.video.string());
    const bool png = format == Format::png, is_picture = !target.picture.empty();
    if (bits && !target.is_video() && *bits == 10)
        fail(ErrorKind::invalid_argument, "--bits 10 is of videos; a picture holds 8, 16 or 32");
    if (bits && png && *bits == 32)
        fail(ErrorKind::invalid_argument, "a PNG file holds 8 or 16 bits, not --bits 32; {}",
             is_picture ? "name an .exr file" : "use --format exr");
    if (bits && !png && *bits == 8)
        fail(ErrorKind::invalid_argument,
             "an EXR file holds halves (--bits 16) or floats (--bits 32), not --bits 8; {}",
             is_picture ? "name a .png file" : "use --format png");
    const int usual = png ? (color == io::SampleType::u16 ? 16 : 8) : (color == io::SampleType::f16 ? 16 : 32);
    const bool is_16 = bits.value_or(usual) == 16;
    if (png) return is_16 ? io::SampleType::u16 : io::SampleType::u8;
    return is_16 ? io::SampleType::f16 : io::SampleType::f32;
}

/// Whether results are to have alpha. Errors: invalid_argument where it is asked for and the output has no place for
/// it.
bool keeps_alpha(const UpscaleOptions& options, const OutputTarget& target, bool has_alpha) {
    const char* without = target.is_video() ? "a video has no alpha"
                          : options.frame_rate == FrameRate::doubled
                              ? "frames in between (--frame-rate x2) have no alpha"
                              : nullptr;
    if (without && options.alpha == Alpha::keep)
        fail(ErrorKind::invalid_argument, "{}; leave --alpha keep out", without);
    if (options.alpha == Alpha::drop || !has_alpha) return false;
    if (!without) return true;
    log(LogLevel::warning,
        "the results are written without the alpha of the sequence's colour: {}; with --alpha drop nothing is said",
        without);
    return false;
}

/// None where a sequence of files is given. Errors: open_video's; invalid_argument for what needs a sequence of files.
std::unique_ptr<io::VideoReader> open_video_input(const UpscaleOptions& options) {
    const std::filesystem::path& path = options.sequence.path;
    if (options.sequence.layout != io::Layout::guess || !io::is_video_input(path)) return nullptr;
    if (options.resume || options.save_every)
        fail(ErrorKind::invalid_argument,
             "{}: no state of a run over a video is kept; leave {} out, and go on with --frames A:, where A is the "
             "first frame that is missing",
             path.string(), options.resume ? "--resume" : "--save-every");
    return io::open_video(path);
}

/// What check_sequence tells of files. Errors: check_described's.
io::ColorFiles colors_of(const io::Sequence& sequence, const io::VideoFacts& facts, bool needs_depth,
                         bool needs_motion) {
    io::check_described(sequence, needs_depth, needs_motion);
    return {.has_alpha = false, .type = facts.bits > 8 ? io::SampleType::u16 : io::SampleType::u8};
}

/// Whether a picture is there that can be read to its end.
bool is_whole(const std::filesystem::path& picture) {
    try {
        io::read_image(picture);
        return true;
    } catch (const Error&) {
        return false;
    }
}

/// The state of an earlier run into the folder, whose pictures are about to be replaced. Errors: file.
void forget_run(const std::filesystem::path& state_file) {
    std::error_code error;
    std::filesystem::remove(state_file, error);
    if (error) fail(ErrorKind::file, "cannot remove {}: {}", state_file.string(), error.message());
}

/// Rules name the upscaler's stages.
InterpolatorOptions interpolator_options(const UpscalerOptions& settings) {
    InterpolatorOptions options = settings;
    options.placement = InterpolatorOptions().placement;
    return options;
}

std::string listing(const std::vector<std::string>& names) {
    return names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", "));
}

void check_views(const std::vector<std::string>& wanted, const std::vector<std::string>& names, const Model& model) {
    for (const std::string& view : wanted)
        if (std::find(names.begin(), names.end(), view) == names.end())
            fail(ErrorKind::invalid_argument, "{} has no view {}; there are: {}", model.name(), view, listing(names));
}

// Whatever can be known to fail does so here, before the first file is written.
void prepare_folders(OutputFolders& folders, const UpscaleOptions& options, const FrameOutput& output,
                     Size output_size) {
    const uintmax_t largest_frame =
        uintmax_t{output.alpha ? 4u : 3u} * sizeof(float) * output_size.width * output_size.height;
    folders.require(output.writer ? folder_of(output.video) : output.folder, largest_frame);
    for (const std::string& view : output.views) folders.require(output.view_folder(view));
    const std::array figures{options.report, options.trace};
    for (const std::filesystem::path& file : figures)
        if (!file.empty()) folders.require(folder_of(file));
    for (const std::filesystem::path& file : figures)  // after all folders are there
        if (!file.empty() && (!file.has_filename() || std::filesystem::is_directory(file)))
            fail(ErrorKind::file, "{} is a folder where a file is to be written", file.string());
}

const char* text_of(Format format) { return format == Format::exr ? "exr" : "png"; }

/// Bits of a value.
const char* text_of(io::SampleType type) {
    return type == io::SampleType::u8 ? "8" : type == io::SampleType::f32 ? "32" : "16";
}

/// RunState::settings.
std::map<std::string, std::string> run_settings(const UpscaleOptions& options, const UpscalerOptions& settings,
                                                const Upscaler& upscaler, const Model& model, Format format,
                                                io::SampleType type) {
    std::map<std::string, std::string> all = cli::run_settings(settings, upscaler, model);
    all["--frame-rate"] = options.frame_rate == FrameRate::doubled ? "x2" : "as rendered";
    all["--alpha"] = options.alpha == Alpha::drop ? "drop" : "keep";
    all["--format"] = text_of(format);
    all["--bits"] = text_of(type);
    return all;
}

/// As exact as those before, where the command line does not say and they have the same format.
std::optional<int> bits_of(const UpscaleOptions& options, Format format, const std::optional<RunState>& state) {
    if (options.bits || !state) return options.bits;
    const std::map<std::string, std::string>& before = state->settings;
    if (!before.contains("--bits") || before.at("--format") != text_of(format)) return std::nullopt;
    return parse_whole<int>(before.at("--bits"));
}

double seconds_since(std::chrono::steady_clock::time_point start) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

void print_placement(const Upscaler& upscaler, const Device& device) {
    const std::vector<PlacedPart> parts = upscaler.placement();
    if (parts.empty()) fmt::print("all on {}\n", device.profile().selector);
    const std::vector<DeviceProfile> devices = device.profiles();
    // By rules nothing was measured.
    const bool measured =
        std::any_of(parts.begin(), parts.end(), [](const PlacedPart& part) { return part.seconds > 0; });
    if (!parts.empty()) fmt::print("{:<16}{}{:>9}  stages\n", "device", measured ? "       ms" : "", "MB in");
    for (const PlacedPart& part : parts)
        fmt::print("{:<16}{}{:>9.2f}  {}\n", fmt::format("{}: {}", part.device, devices[part.device].selector),
                   measured ? fmt::format("{:>9.2f}", 1e3 * part.seconds) : "",
                   1e-6 * static_cast<double>(part.bytes_in), fmt::join(part.stages, ", "));
    const std::vector<double> alone = upscaler.seconds_alone();
    for (size_t index = 0; index < alone.size(); ++index)
        fmt::print("{:<16}{:>9.2f}{:>9}  all stages\n", fmt::format("{} alone", index), 1e3 * alone[index], "");
    for (const PlacedPart& part : parts)
        for (const PlacedPart::Input& input : part.inputs)
            if (input.frames_ago > 0)
                fmt::print("{} waits for {} of the frame before\n", part.stages.front(), input.value);
}

void upscale(const UpscaleOptions& options) {
    Model found = find_model(options.wish);
    std::unique_ptr<io::VideoReader> reader = open_video_input(options);
    const bool is_video = reader != nullptr;
    // What a part of it is run with is what all of it would be.
    const io::Sequence whole = is_video ? sequence_of(options.sequence.path, reader->facts(), found.scale())
                                        : options.sequence.read_whole(found.scale());
    // A video's one frame stands for all: those that are asked for are its source's.
    const FrameRange range = is_video ? FrameRange{} : options.sequence.frames;
    const size_t end = range.checked_end(whole.frames.size(), options.sequence.path);
    const auto [model, output_size] = choose_model(std::move(found), options.wish, whole, whole.is_dynamic(),
                                                   "the sequence " + options.sequence.path.string());
    const OutputTarget target = output_target(options.output, Source::files);
    if (is_video && !target.picture.empty())
        fail(ErrorKind::invalid_argument, "--output {} is one picture, and {} a video; name a folder",
             target.picture.string(), options.sequence.path.string());
    if (!target.picture.empty()) check_picture(options, target, end - range.first);
    check_crf(options.crf, target);
    if (target.is_video() && (options.resume || options.save_every))
        fail(ErrorKind::invalid_argument,
             "a video is written from its first frame to its last and cannot be gone on with; leave {} out, or name a "
             "folder as --output, in place of {}",
             options.resume ? "--resume" : "--save-every", target.video.string());
    const Format format = output_format(options, target, whole.color_space);
    const Device device = Device::open(options.device);
    UpscalerOptions settings = options_for(options.settings, whole, whole.is_dynamic(), output_size);
    settings.profile = options.print_profile || !options.trace.empty() || !options.report.empty();
    if (!options.views.empty()) {
        const std::vector<std::string> names = Upscaler(device, model, whole.render_size, settings).view_names();
        if (options.views == only_list) {
            fmt::print("{}\n", fmt::join(names, "\n"));
            return;
        }
        check_views(options.views, names, model);
        settings.views = options.views;
    }
    // Rules of --place may name what only alpha brings: whether there is any, the files tell.
    UpscalerOptions before_files = settings;
    before_files.placement = UpscalerOptions().placement;
    Upscaler upscaler(device, model, whole.render_size, before_files);
    std::optional<Interpolator> interpolator;
    if (options.frame_rate == FrameRate::doubled && settings.ui_format)
        fail(ErrorKind::invalid_argument,
             "--frame-rate x2: the sequence has user interface (`ui`), which would move with the picture in the frames "
             "in between; take it out of the JSON, and draw it on the result");
    if (options.frame_rate == FrameRate::doubled)
        interpolator.emplace(device, upscaler.render_size(), upscaler.output_size(), interpolator_options(settings));

    const std::filesystem::path state_file = run_state_file(target.folder);
    const char* const extension = format == Format::exr ? ".exr" : ".png";
    const size_t asked = range.first;
    const RunFrames run =
        options.resume
            ? resumed_frames(range, whole, options.sequence.path, state_file,
                             [&](const std::string& name) { return is_whole(target.folder / (name + extension)); })
            : RunFrames{asked, asked, end};
    const std::optional<int> bits = bits_of(options, format, run.state);
    const auto settings_of_run = [&](io::SampleType type) {
        return run_settings(options, settings, upscaler, model, format, type);
    };
    if (run.state)
        check_run_state(state_file, *run.state, settings_of_run(output_type(bits, format, target, io::SampleType::u8)),
                        whole);
    if (run.is_empty()) {
        fmt::print("nothing is left to make: frames {} to {} were made by the runs before\n", asked, end - 1);
        return;
    }
    io::Sequence sequence = whole;
    FrameRange{run.begin, run.end}.cut(sequence.frames, options.sequence.path);

    const bool needs_depth = interpolator || upscaler.needs_depth();
    const bool needs_motion = interpolator || upscaler.needs_motion();
    const io::ColorFiles colors = is_video ? colors_of(sequence, reader->facts(), needs_depth, needs_motion)
                                           : io::check_sequence(sequence, needs_depth, needs_motion);
    settings.alpha = keeps_alpha(options, target, colors.has_alpha);
    if (settings.alpha) settings.color_format.channels = settings.output_format.channels = 4;
    if (settings.alpha || settings.placement != before_files.placement)
        upscaler = Upscaler(device, model, whole.render_size, settings);
    const io::SampleType type = output_type(bits, format, target, colors.type);
    warn_of_facts(sequence, upscaler, model);
    const Size made = scaled(sequence.render_size, model.scale());
    std::optional<VideoOutput> video;
    if (target.is_video()) video.emplace(target);
    OutputFolders folders;  // which go after what lies in them
    std::optional<Checkpoints> checkpoints;
    if (!video && !is_video && target.picture.empty())
        checkpoints.emplace(Run{state_file, settings_of_run(type), whole, run.first, run.begin}, upscaler,
                            interpolator ? &*interpolator : nullptr, options.save_every);
    const FrameOutput output{target.folder,
                             extension,
                             type,
                             sequence.color_space,
                             options.views,
                             made,
                             upscaler.output_size() == sequence.output_size(),
                             interpolator.has_value(),
                             options.png_compression,
                             settings.fallback,
                             target.video,
                             video ? &*video : nullptr,
                             nullptr,
                             settings.alpha,
                             checkpoints ? &*checkpoints : nullptr,
                             run.begin > run.first,
                             target.picture,
                             colors.tags};
    for (const io::FrameFiles& frame : sequence.frames) {
        upscaler.output_size(sequence.render_size_of(frame));
        if (interpolator) interpolator->output_size(sequence.render_size_of(frame));
    }
    refuse_overwriting_inputs(options.sequence.path, sequence, model, output, options.report, options.trace);
    prepare_folders(folders, options, output, upscaler.output_size());

    if (run.begin > run.first) fmt::print("going on at frame {} of {}\n", run.begin, whole.frames.size());
    if (upscaler.output_size() != made)
        fmt::print("resampling {}x{} to {}x{}{}\n", made.width, made.height, upscaler.output_size().width,
                   upscaler.output_size().height, options.wish.output_size ? "" : ", the output_size of the sequence");

    if (is_video && reader->facts().has_audio)
        fmt::print("{}: its sound is not carried over\n", options.sequence.path.string());

    std::future<void> watch;
    if (upscaler.needs_motion() && !options.no_check)
        watch = watch_conventions(sequence, options.sequence.path.string());
    const auto start = std::chrono::steady_clock::now();
    {
        Progress progress("preparing");
        upscaler.prepare([&](double fraction) { progress.update(fraction); });
        if (interpolator) interpolator->prepare([&](double fraction) { progress.update(fraction); });
    }
    const double prepare_seconds = seconds_since(start);
    if (run.state)
        restore_run(state_file, *run.state, upscaler, interpolator ? &*interpolator : nullptr);
    else if (checkpoints)
        checkpoints->start_over();
    else if (is_video && !video)
        forget_run(state_file);
    if (options.explain_placement) print_placement(upscaler, device);

    Trace trace(!options.trace.empty());
    const auto frames_start = std::chrono::steady_clock::now();
    std::vector<FrameResult> frames;
    {
        const size_t under_way = frames_under_way(upscaler, output);
        const auto pictures =
            is_video ? std::make_unique<VideoSource>(std::move(reader), sequence, options.sequence.frames) : nullptr;
        const auto files = is_video ? nullptr
                                    : std::make_unique<SequenceSource>(sequence, needs_depth || needs_motion,
                                                                       output.measure, settings.alpha, under_way);
        FrameSource& source = is_video ? static_cast<FrameSource&>(*pictures) : *files;
        const std::shared_ptr<Upscaler> only(std::shared_ptr<void>(), &upscaler);  // which it does not own
        Progress progress("upscaling");
        const auto finished = [&](FrameResult frame) {
            frames.push_back(std::move(frame));
            if (checkpoints) checkpoints->written(frames.size());
            progress.update(frames.size(), pictures ? pictures->frames() : sequence.frames.size());
        };
        const Interrupt interrupt;  // which would leave pictures whole, but no video, and no state of the run
        if (video)
            video->open({.size = upscaler.output_size(),
                         .frame_rate = sequence.frame_rate * (interpolator ? 2 : 1),
                         .crf = options.crf,
                         .bits = bits.value_or(8)});
        try {
            upscale_frames(
                source, [&](SourceFrame&) { return only; }, interpolator ? &*interpolator : nullptr, output, under_way,
                trace, finished);
        } catch (const std::exception&) {
            if (video) video->keep();
            throw;
        }
        if (video) video->finish();
        if (pictures && Interrupt::came() && !pictures->is_over())
            fail(ErrorKind::file, "interrupted: {} has {} frames of {}", options.output, frames.size(),
                 options.sequence.path.string());
        if (!pictures && Interrupt::came() && frames.size() < sequence.frames.size()) {
            if (video)
                fail(ErrorKind::file, "interrupted: {} has the first {} of {} frames", target.video.string(),
                     frames.size(), sequence.frames.size());
            if (!target.picture.empty())
                fail(ErrorKind::file, "interrupted: {} is not written", target.picture.string());
            fail(ErrorKind::file, "interrupted after {} of {} frames; --resume {} in {}", frames.size(),
                 sequence.frames.size(), frames.empty() ? "begins" : "goes on", target.folder.string());
        }
        if (checkpoints && checkpoints->is_kept() && run.end < whole.frames.size())
            fmt::print("made frames {} to {} of {}; --resume goes on there\n", run.begin, run.end - 1,
                       whole.frames.size());
    }

    std::vector<StageProfile> stages = upscaler.take_profile();
    MemoryRequirements memory = upscaler.memory_requirements();
    if (interpolator) {
        std::ranges::move(interpolator->take_profile(), std::back_inserter(stages));
        memory += interpolator->memory_requirements();
    }
    const RunReport report{.sequence = options.sequence.path,
                           .model = model,
                           .devices = device.profiles(),
                           .placement = upscaler.placement(),
                           .options = settings,
                           .render_size = upscaler.render_size(),
                           .output_size = upscaler.output_size(),
                           .memory = memory,
                           .programs_compiled = device.programs_compiled(),
                           .prepare_seconds = prepare_seconds,
                           .frames_seconds = seconds_since(frames_start),
                           .largest_jitter_distance = upscaler.largest_jitter_distance(),
                           .frames = std::move(frames),
                           .stages = std::move(stages)};
    report.print_summary();
    if (options.print_profile) report.print_stages();
    if (!options.report.empty()) report.write_json(options.report);
    if (!options.trace.empty()) {
        std::vector<std::string> names;
        for (const FrameResult& frame : report.frames) names.push_back(frame.name);
        trace.add_device_spans(report.stages, report.devices, names);
        trace.write(options.trace);
    }
}

}  // namespace

void add_upscale_command(CLI::App& app) {
    CLI::App& command = *app.add_subcommand("upscale", "Upscale a sequence of rendered frames");
    const auto options = std::make_shared<UpscaleOptions>();
    command
        .add_option("SEQUENCE", options->sequence.path,
                    "The sequence's folder or JSON. For models that need colour alone, also a folder of images, one "
                    "image, or a "
                    "video (.mp4, .m4v, .mov, .mkv, .webm, .avi)")
        ->required();
    command
        .add_option("--model", options->wish.model,
                    "A shipped model's or filter's name (clarus models), or a file, .safetensors or .onnx")
        ->required();
    command
        .add_option("-o,--output", options->output,
                    "Folder for the images; those of the same name are replaced. Or a video, .mp4, .mkv (H.264) or "
                    ".webm (VP9); of one frame, a picture, .png or .exr")
        ->type_name("DIR|FILE");
    add_video_options(command, options->crf);
    command
        .add_option("--device", options->device,
                    "auto; gpu, cpu or dsp; an index, 0:1; a part of a name; with /N, a sub-device of N units; with "
                    "=CLASS, treated as of that class; several between commas work together")
        ->type_name("SEL");
    command
        .add_option("--scale", options->wish.scale,
                    "In place of the sequence's, for models of any scale (clarus models): filters from 1, others in "
                    "their range. Without --output-size, output is S times the render size")
        ->type_name("S");
    command
        .add_option_function<std::string>(
            "--output-size",
            [options](const std::string& text) { options->wish.output_size = parse_output_size(text); },
            "In place of the render size times the model's scale, or of the sequence's output_size: what the model "
            "makes is resampled to it, to a quarter to four times along each axis")
        ->type_name("WxH");
    add_pipeline_options(command, options->settings.pipeline_options);
    options->sequence.add_to(command);
    add_precision_option(command, options->settings.precision);
    add_choice<Tuning, Tuning>(
        command, "--tuning", options->settings.tuning,
        {{"stored", Tuning::stored},
         {"measure", Tuning::measure},
         {"fixed", Tuning::fixed},
         {"obvious", Tuning::obvious}},
        "Choose kernels by what was measured here before, by measuring now, by what comes with Clarus "
        "alone, or the simplest ones, to check the others by");
    add_choice<std::optional<Format>, Format>(command, "--format", options->format,
                                              {{"png", Format::png}, {"exr", Format::exr}},
                                              "png unless the sequence is linear HDR");
    command
        .add_option(
            "--bits", options->bits,
            "Of a value in the pictures: 8 or 16 of png; 16, half, or 32, float, of exr; by default 16 where "
            "the sequence's colour has 16 of that kind, else 8 of png and 32 of exr. Of a video 8, the default, "
            "or 10")
        ->type_name("8|10|16|32")
        ->check(CLI::IsMember({8, 10, 16, 32}).description(""));
    command
        .add_option(
            "--png-compression", options->png_compression,
            "Of PNG files, from 0, none, to 9; 6 takes four times as long as 1, for files about a tenth smaller")
        ->type_name("LEVEL")
        ->check(CLI::Range(0, 9))
        ->capture_default_str();
    add_choice<std::optional<Alpha>, Alpha>(
        command, "--alpha", options->alpha, {{"keep", Alpha::keep}, {"drop", Alpha::drop}},
        "Where the sequence's colour has alpha: upscaled by bicubic and kept, unless "
        "told otherwise");
    add_choice<Antialiasing, Antialiasing>(command, "--antialias", options->settings.antialias,
                                           {{"mlaa", Antialiasing::mlaa}},
                                           "Antialias what the model shows, morphologically");
    add_choice<Antialiasing, Antialiasing>(command, "--antialias-input", options->settings.antialias_input,
                                           {{"mlaa", Antialiasing::mlaa}}, "Antialias the colour that the model sees");
    command
        .add_option("--sharpen", options->settings.sharpen,
                    "Sharpen what the model shows, last, by MNSS's filter; 0.15 where no strength is given")
        ->type_name("BETA")
        ->expected(0, 1)
        ->default_str("0.15");
    add_choice<FrameRate, FrameRate>(command, "--frame-rate", options->frame_rate, {{"x2", FrameRate::doubled}},
                                     "Also make the picture between each frame and the one before it, FRAME-before, "
                                     "from motion and depth");
    command
        .add_option("--view", options->views,
                    "Also write what the pipeline saw inside, to DIR/views/NAME; `list` "
                    "prints the names. May be repeated")
        ->type_name("NAME")
        ->allow_extra_args(false);
    add_placement_options(command, options->settings);
    command.add_flag("--no-check", options->no_check,
                     "Do not hold the first frames against what the JSON declares, as clarus check does");
    command.add_flag("--explain-placement", options->explain_placement,
                     "Print which stages each device makes, and what moves between devices");
    command.add_flag("--profile", options->print_profile, "Print the time, GFLOP/s and GB/s of every stage");
    command.add_option("--trace", options->trace, "Write a Chrome trace (chrome://tracing, ui.perfetto.dev)")
        ->type_name("FILE");
    command
        .add_option("--report", options->report,
                    "Write figures as JSON: quality where there are references, stages, device, memory")
        ->type_name("FILE");
    command.add_flag("--resume", options->resume,
                     "Go on where a run into the same folder ended, was ended or was killed, with what the model keeps "
                     "of its last frame: the bytes are those of one run");
    command
        .add_option("--save-every", options->save_every,
                    "Between the states from which --resume can go on, 0 for one a frame, at most 1e6; by default 10, "
                    "longer where writing would take more than 5 % of the time")
        ->type_name("SECONDS")
        ->check(CLI::Range(0.0, 1e6).description(""))
        ->check(finite());
    command.footer(
        "Examples:\n"
        "  clarus upscale sequence --model enss-s-x2 --output upscaled\n"
        "  clarus upscale sequence --model bicubic --output upscaled --frames 0:24\n"
        "  clarus upscale sequence --model enss-s-x2 --output upscaled --device gpu --profile --report report.json\n"
        "  clarus upscale sequence --model enss-s-x2 --output upscaled --output-size 2560x1440\n"
        "  clarus upscale sequence --model enss-s-x2 --output upscaled --frame-rate x2\n"
        "  clarus upscale sequence --model enss-s-x2 --output upscaled.mp4 --crf 14\n"
        "  clarus upscale sequence --model enss-s-x2 --output upscaled --bits 16\n"
        "  clarus upscale sequence --model enss-s-x2 --output upscaled --resume\n"
        "  clarus upscale sequence --model enss-s-x2 --view list\n"
        "  clarus upscale photo.png --model espcn-x2 --output larger.png\n"
        "  clarus upscale clip.mp4 --model espcn-x2 --output larger.mp4\n"
        "  clarus upscale sequence --model mnss-x2 --output upscaled --device \"gpu, cpu\" --explain-placement\n"
        "  clarus upscale sequence --model mnss-x2 --output upscaled --device \"cpu/1, cpu/1=dsp\" "
        "--place \"*convolution*=dsp\"");
    command.callback([options] {
        if (options->output.empty() && options->views != only_list) throw CLI::RequiredError("--output");
        upscale(*options);
    });
}

}  // namespace clarus::cli
