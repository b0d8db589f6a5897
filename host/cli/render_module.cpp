#include <fmt/format.h>
#include <tbb/global_control.h>

#include <cmath>
#include <filesystem>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>
#include <string>
#include <utility>

#include "base/error.h"
#include "base/parse.h"
#include "clarus/jitter.h"
#include "clarus/log.h"
#include "clarus/quality.h"
#include "cli/choice.h"
#include "cli/interrupt.h"
#include "cli/progress.h"
#include "cli/share_options.h"
#include "cli/shared_frames.h"
#include "cli/taken_files.h"
#include "io/encode.h"
#include "io/output_layout.h"
#include "render/renderer.h"
#include "render/sequence_writer.h"
#include "render/worlds/world.h"

namespace clarus::cli {
namespace {

constexpr int largest_side = 16384;

struct Options {
    std::string scene = "demo", size = "480x270", jitter = "halton:16";
    std::string depth, motion_at;  // empty: as the layout has it
    io::Layout layout = io::Layout::native;
    double scale = 2, far_plane = 250, dynamic_resolution = 1;
    int frames = 12, first_frame = 0, frame_step = 1, path = 1, samples = 1, reference_samples = 16, threads = 0;
    bool reversed = false, motion_jittered = false, no_reference = false, output_buffers = false;
    bool hdr = false, force = false;
    std::filesystem::path output;
    ShareOptions share;  // in place of the output
};

Size render_size(std::string_view text) {
    const std::optional<Size> size = parse_size(text);
    if (!size || size->width > largest_side || size->height > largest_side)
        fail(ErrorKind::invalid_argument, "--size \"{}\" is not WIDTHxHEIGHT with both from 1 to {}, such as 480x270",
             text, largest_side);
    return *size;
}

/// "halton:N", or "halton:N+K" with frame 0 at the sequence's point K.
struct Halton {
    int points = 0, start = 0;
};

std::optional<Halton> parse_halton(std::string_view text) {
    constexpr std::string_view prefix = "halton:";
    if (!text.starts_with(prefix)) return std::nullopt;
    text.remove_prefix(prefix.size());
    const size_t plus = text.find('+');
    const std::optional<int> points = parse_whole<int>(text.substr(0, plus));
    if (!points || *points < 1 || *points > 4096) return std::nullopt;
    if (plus == std::string_view::npos) return Halton{*points, 0};
    const std::optional<int> start = parse_whole<int>(text.substr(plus + 1));
    if (!start || *start < 0 || *start >= *points) return std::nullopt;
    return Halton{*points, *start};
}

/// A frame's jitter by its number on the path.
std::function<Vec2(int)> parse_jitter(std::string_view text, double scale) {
    if (text == "none") return [](int) { return Vec2{}; };
    if (text == "mnss" && (scale == 2 || scale == 3)) {
        return [scale](int frame) { return mnss_jitter(frame, static_cast<int>(scale)); };
    }
    if (text == "random" && scale == std::floor(scale)) {
        return [scale](int frame) { return random_jitter(frame, static_cast<int>(scale)); };
    }
    const std::optional<Halton> halton = parse_halton(text);
    if (!halton) {
        fail(ErrorKind::invalid_argument,
             "--jitter \"{}\" is neither \"none\", nor \"mnss\" (at the scales 2 and 3), nor \"random\" (at whole "
             "scales), nor \"halton:N\" with N from 1 to 4096, nor \"halton:N+K\" with K from 0 and below N",
             text);
    }
    return [halton = *halton](int frame) { return halton_jitter(halton.start + frame, halton.points); };
}

void check_at_least(const char* option, int value, int least) {
    if (value < least) fail(ErrorKind::invalid_argument, "{} {} is below {}", option, value, least);
}

/// Sizes, scale and conventions; frames come later.
io::Sequence sequence_of(const Options& options, const io::OutputLayout& layout) {
    const bool whole = options.scale == std::floor(options.scale) && options.scale >= 2 && options.scale <= 6;
    if (!whole && options.scale != 1.5 && options.scale != 1.7) {
        fail(ErrorKind::invalid_argument, "--scale {} is none of 1.5, 1.7, 2, 3, 4, 5, 6", options.scale);
    }
    if (!options.depth.empty() && options.depth != "linear" && options.depth != "projective") {
        fail(ErrorKind::invalid_argument, "--depth \"{}\" is neither \"linear\" nor \"projective\"", options.depth);
    }
    if (!options.motion_at.empty() && options.motion_at != "jittered" && options.motion_at != "centre") {
        fail(ErrorKind::invalid_argument, "--motion-at \"{}\" is neither \"centre\" nor \"jittered\"",
             options.motion_at);
    }
    if (!(options.dynamic_resolution >= 0.1 && options.dynamic_resolution <= 1))
        fail(ErrorKind::invalid_argument, "--dynamic-resolution {} is not from 0.1 to 1", options.dynamic_resolution);
    if (options.dynamic_resolution < 1 && options.motion_jittered)
        fail(ErrorKind::invalid_argument, "--motion-jittered does not go with --dynamic-resolution");
    io::Sequence sequence;
    sequence.render_size = render_size(options.size);
    sequence.scale = options.scale;
    sequence.frame_rate = static_cast<double>(render::frame_rate) / options.frame_step;
    sequence.mip_bias = mip_bias(options.scale);
    sequence.color_space = options.hdr ? ColorSpace::linear : ColorSpace::srgb;
    sequence.depth = {.projective = options.depth == "projective", .reversed = options.reversed};
    sequence.motion.jittered = options.motion_jittered;
    sequence.motion.sampled_at_jitter = options.motion_at != "centre";
    layout.prescribe(sequence);
    if (options.layout == io::Layout::native) return sequence;

    const auto refuse = [](const char* option) {
        fail(ErrorKind::invalid_argument, "{} does not go with this --layout, which leaves no choice there", option);
    };
    if (options.hdr && sequence.color_space == ColorSpace::srgb) refuse("--hdr");
    if (!options.depth.empty() && sequence.depth.projective != (options.depth == "projective")) refuse("--depth");
    if (options.reversed && !sequence.depth.reversed) refuse("--reversed");
    if (options.motion_at == "centre") refuse("--motion-at");
    if (options.motion_jittered && !sequence.motion.jittered) refuse("--motion-jittered");
    if (options.output_buffers) refuse("--output-buffers");
    if (options.dynamic_resolution < 1) refuse("--dynamic-resolution");
    return sequence;
}

render::RenderSettings settings_of(const Options& options, const io::Sequence& sequence) {
    render::RenderSettings settings;
    settings.render_size = sequence.render_size;
    settings.output_size = sequence.output_size();
    settings.mip_bias = static_cast<float>(sequence.mip_bias.value());
    settings.hdr = sequence.color_space == ColorSpace::linear;
    settings.samples = options.samples;
    settings.output_buffers = options.output_buffers;
    settings.motion_at_centre = !sequence.motion.sampled_at_jitter;
    settings.far_plane = static_cast<float>(options.far_plane);
    if (!(options.far_plane >= 1) || !(options.far_plane <= 1e6)) {
        fail(ErrorKind::invalid_argument, "--far {} is not from 1 to 1000000 metres", options.far_plane);
    }
    if (options.samples < 1 || options.samples > 256) {
        fail(ErrorKind::invalid_argument, "--samples {} is not from 1 to 256", options.samples);
    }
    settings.reference_grid = 0;
    if (options.no_reference) return settings;
    const int side = static_cast<int>(std::lround(std::sqrt(std::max(0, options.reference_samples))));
    if (side < 1 || side > 64 || side * side != options.reference_samples) {
        fail(ErrorKind::invalid_argument, "--reference-samples {} is not a square number from 1 to 4096",
             options.reference_samples);
    }
    settings.reference_grid = side;
    return settings;
}

/// All that the images depend on.
nlohmann::ordered_json recipe_of(const Options& options, const io::Sequence& sequence) {
    return {{"scene", options.scene},
            {"path", options.path},
            {"first_frame", options.first_frame},
            {"frame_step", options.frame_step},
            {"frames", options.frames},
            {"render_size", {sequence.render_size.width, sequence.render_size.height}},
            {"scale", sequence.scale},
            {"dynamic_resolution", options.dynamic_resolution},
            {"jitter", options.jitter},
            {"samples", options.samples},
            {"reference_samples", options.no_reference ? 0 : options.reference_samples},
            {"output_buffers", options.output_buffers},
            {"hdr", sequence.color_space == ColorSpace::linear},
            {"depth", sequence.depth.projective ? "projective" : "linear"},
            {"reversed", sequence.depth.reversed},
            {"far", options.far_plane},
            {"motion_at", sequence.motion.sampled_at_jitter ? "jittered" : "centre"},
            {"motion_jittered", sequence.motion.jittered}};
}

/// The sequence's frame `index`. What moves has come from where it was `frame_step` frames of the path before.
render::FrameState frame_state(const render::World& world, const Options& options, int index) {
    const int last = options.first_frame + index * options.frame_step;
    render::FrameState state = world.frame(last);
    for (int frame = last - 1; frame > std::max(0, last - options.frame_step); --frame) {
        const render::FrameState before = world.frame(frame);
        state.cut = state.cut || before.cut;
        state.previous_camera = before.previous_camera;
        state.previous_seconds = before.previous_seconds;
    }
    return state;
}

/// Down to the smallest share of the sequence's render size in the middle of the sequence, and up again.
Size frame_size(const Options& options, Size largest, int index) {
    const double turn = 2 * std::numbers::pi * index / options.frames;
    const double share = 1 - (1 - options.dynamic_resolution) * (1 - std::cos(turn)) / 2;
    const auto side = [&](int whole) { return std::max(1, static_cast<int>(std::lround(whole * share))); };
    return {side(largest.width), side(largest.height)};
}

void check_cuts(const render::World& world, const Options& options) {
    if (options.layout != io::Layout::qrisp) return;
    for (int i = 1; i < options.frames; ++i) {
        if (!frame_state(world, options, i).cut) continue;
        fail(ErrorKind::invalid_argument,
             "the QRISP layout cannot say that frame {} of this path resets; take --frames {}, or another --path", i,
             i);
    }
}

/// Calls visit(frame, state, settings) for every frame, until that returns false. The frame's name and files are left
/// out.
template <typename Visit>
void visit_frames(const Options& options, const io::Sequence& sequence, render::RenderSettings settings,
                  const render::World& world, Visit visit) {
    const std::function<Vec2(int)> jitter = parse_jitter(options.jitter, options.scale);
    Progress progress("rendering");
    for (int i = 0; i < options.frames; ++i) {
        const render::FrameState state = frame_state(world, options, i);
        io::FrameFiles frame;
        settings.render_size = frame_size(options, sequence.render_size, i);
        if (settings.render_size != sequence.render_size) frame.render_size = settings.render_size;
        frame.jitter = jitter(options.first_frame + i);
        frame.reset = state.cut;
        frame.near_plane = settings.near_plane;
        frame.far_plane = settings.far_plane;
        frame.camera = render::Camera(state.camera, settings.render_size)
                           .matrices(settings.near_plane, settings.far_plane, sequence.depth.reversed);
        if (!visit(frame, state, settings)) return;
        progress.update(static_cast<size_t>(i) + 1, static_cast<size_t>(options.frames));
    }
}

/// As a game does: nothing is written.
void share(const Options& options, const io::Sequence& sequence, render::RenderSettings settings,
           const render::World& world) {
    settings.reference_grid = 0;
    settings.output_buffers = false;
    const Interrupt interrupt;
    SharedFrames shared(sequence, true, true, options.dynamic_resolution < 1, options.share);
    shared.tell_waiting();
    Vec2 previous_jitter;
    const auto render_and_share = [&](io::FrameFiles& frame, const render::FrameState& state,
                                      const render::RenderSettings& frame_settings) {
        render::RenderedFrame images = render::render_frame(*world.scene, state, frame.jitter, frame_settings);
        const Vec2 before = shared.state().ready == 0 ? frame.jitter : previous_jitter;
        previous_jitter = frame.jitter;
        return shared.share(frame, {.color = std::move(images.color),
                                    .depth = io::encode_depth(images.depth, sequence, frame),
                                    .motion = io::encode_motion(images.motion, sequence, frame, frame.jitter, before),
                                    .reference = {}});
    };
    visit_frames(options, sequence, settings, world, render_and_share);
    shared.finish();
    fmt::print("{} frames shared, {} upscaled or skipped\n", shared.state().ready, shared.state().released);
}

void run(const Options& options) {
    if (options.output.empty() == options.share.name.empty())
        throw CLI::ValidationError("--output", "one of --output and --share is needed");
    auto layout = io::output_layout(options.output, options.layout);
    const io::Sequence sequence = sequence_of(options, *layout);
    const render::RenderSettings settings = settings_of(options, sequence);
    parse_jitter(options.jitter, options.scale);
    check_at_least("--frames", options.frames, 1);
    check_at_least("--frame-step", options.frame_step, 1);
    check_at_least("--first-frame", options.first_frame, 0);
    check_at_least("--path", options.path, 0);
    check_at_least("--threads", options.threads, 0);
    if (!options.share.trace.empty()) {
        TakenFiles taken;
        taken.add(options.scene, "the scene");
        taken.take("--trace", options.share.trace);
    }
    std::optional<tbb::global_control> threads;
    if (options.threads > 0) threads.emplace(tbb::global_control::max_allowed_parallelism, options.threads);

    const render::World world = render::make_world(options.scene, options.path);
    if (!options.share.name.empty()) return share(options, sequence, settings, world);
    check_cuts(world, options);
    render::SequenceWriter writer(std::move(layout), sequence, settings, recipe_of(options, sequence), options.force);
    visit_frames(
        options, sequence, settings, world,
        [&](const io::FrameFiles& frame, const render::FrameState& state,
            const render::RenderSettings& frame_settings) {
            writer.add(frame, [&] { return render::render_frame(*world.scene, state, frame.jitter, frame_settings); });
            return true;
        });
    writer.finish();
}

void define(CLI::App* command) {
    const auto options = std::make_shared<Options>();
    std::string kinds = "Scene:";
    for (const render::WorldKind& kind : render::world_kinds()) kinds += "\n" + kind.name + ": " + kind.description;
    command->add_option("--scene", options->scene, kinds)->capture_default_str();
    command
        ->add_option("--path", options->path,
                     "Number from 0 that chooses the camera's path, and what stands and moves in the scene")
        ->capture_default_str();
    command->add_option("--frames", options->frames, "How many frames")->capture_default_str();
    command->add_option("--first-frame", options->first_frame, "Where on the path to start")->capture_default_str();
    command
        ->add_option("--frame-step", options->frame_step,
                     "Take every Nth frame of the path, with the motion between those taken: 60 / N frames a second")
        ->type_name("N")
        ->capture_default_str();
    command->add_option("--size", options->size, "Render size")->type_name("WxH")->capture_default_str();
    command->add_option("--scale", options->scale, "Output size over render size: 1.5, 1.7, or 2 to 6")
        ->capture_default_str();
    command
        ->add_option("--dynamic-resolution", options->dynamic_resolution,
                     "The render size goes down to this share of --size along each side, and up again: 0.1 to 1")
        ->type_name("SHARE")
        ->capture_default_str();
    command
        ->add_option(
            "--jitter", options->jitter,
            "halton:N; halton:N+K, which is K frames further on in it; mnss (scales 2 and 3); random (one of the "
            "scale² sub-pixels' centres; whole scales); or none")
        ->capture_default_str();
    command->add_option("--samples", options->samples, "Samples a pixel of the input's colour, averaged")
        ->capture_default_str();
    command->add_option("--reference-samples", options->reference_samples, "Samples a reference pixel, a square number")
        ->capture_default_str();
    command->add_flag("--no-reference", options->no_reference, "Leave the reference out");
    command->add_flag("--output-buffers", options->output_buffers,
                      "Also at output resolution, at pixel centres: reference_aliased (one sample a pixel), "
                      "reference_depth (as depth), reference_motion (as motion, without jitter)");
    command->add_flag("--hdr", options->hdr, "Linear radiance in EXR files; otherwise display-encoded PNG files");
    command->add_option("--depth", options->depth, "linear (where not told otherwise) or projective");
    command->add_flag("--reversed", options->reversed, "Depth is 1 at the near plane, 0 at the far one");
    command->add_option("--far", options->far_plane, "Far plane in metres")->capture_default_str();
    command->add_option("--motion-at", options->motion_at,
                        "Where motion is sampled: jittered, as the colour is (where not told otherwise), or centre");
    command->add_flag("--motion-jittered", options->motion_jittered,
                      "Leave the camera's jitter inside the motion vectors' values");
    add_choice<io::Layout, io::Layout>(
        *command, "--layout", options->layout,
        {{"native", io::Layout::native}, {"qrisp", io::Layout::qrisp}, {"nss", io::Layout::nss}},
        "How the sequence is laid out in files [native]. qrisp and nss have conventions of their own for depth and "
        "motion; nss is linear radiance");
    command->add_option("--threads", options->threads, "Threads to render with; 0: all")->capture_default_str();
    command->add_flag("--force", options->force, "Replace the sequence that is there");
    command->add_option("-o,--output", options->output,
                        "Where to, named as the layout's readers take it. native: a folder; qrisp: "
                        "<scene>/<540p|360p|270p>/MipBias…Jittered/<segment>; nss: <dataset>/<sequence>.json");
    add_share_options(*command, options->share);
    command->footer(
        "A render that was interrupted continues when it is started again with the same options.\n"
        "Examples:\n"
        "  clarus render --scene demo --size 480x270 --scale 2 --frames 12 --path 1 -o seq/\n"
        "  clarus render --scene demo --size 480x270 --scale 2 --frames 600 --share game    as a game, see clarus "
        "serve");
    command->callback([options] { run(*options); });
}

}  // namespace
}  // namespace clarus::cli

/// Gives the subcommand its options and what it does. `log` takes what the module has to say: its own log is not the
/// program's.
extern "C" __attribute__((visibility("default"))) void clarus_define_render_command(CLI::App& command,
                                                                                    clarus::LogCallback log) {
    clarus::set_log_callback(std::move(log));
    clarus::cli::remove_unfinished_files_when_ended();  // the module's own
    clarus::cli::define(&command);
}
