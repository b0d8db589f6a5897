#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <filesystem>
#include <memory>
#include <string>

#include "base/error.h"
#include "clarus/jitter.h"
#include "cli/commands.h"
#include "cli/progress.h"
#include "render/renderer.h"
#include "render/sequence_writer.h"
#include "render/worlds/camera_path.h"
#include "render/worlds/demo_scene.h"

namespace clarus::cli {
namespace {

constexpr int largest_side = 16384;

struct Options {
    std::string scene = "demo", size = "480x270", jitter = "halton:16", motion_at = "jittered";
    double scale = 2;
    int frames = 12, first_frame = 0, path = 1, reference_samples = 16;
    bool no_reference = false, hdr = false, force = false;
    std::filesystem::path output;
};

bool parse_whole(std::string_view text, int& value) {
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    return error == std::errc() && end == text.data() + text.size();
}

Size parse_size(std::string_view text) {
    Size size;
    const size_t cross = text.find('x');
    if (cross == std::string_view::npos || !parse_whole(text.substr(0, cross), size.width) ||
        !parse_whole(text.substr(cross + 1), size.height) || size.width < 1 || size.height < 1 ||
        size.width > largest_side || size.height > largest_side) {
        fail(ErrorKind::invalid_argument, "--size \"{}\" is not WIDTHxHEIGHT with both from 1 to {}, such as 480x270",
             text, largest_side);
    }
    return size;
}

/// Points of the Halton pattern; 0 for no jitter.
int parse_jitter(std::string_view text) {
    constexpr std::string_view prefix = "halton:";
    int points = 0;
    if (text == "none") return 0;
    if (!text.starts_with(prefix) || !parse_whole(text.substr(prefix.size()), points) || points < 1 || points > 4096) {
        fail(ErrorKind::invalid_argument, "--jitter \"{}\" is neither \"none\" nor \"halton:N\" with N from 1 to 4096",
             text);
    }
    return points;
}

void check_at_least(const char* option, int value, int least) {
    if (value < least) fail(ErrorKind::invalid_argument, "{} {} is below {}", option, value, least);
}

render::RenderSettings settings_of(const Options& options) {
    render::RenderSettings settings;
    settings.render_size = parse_size(options.size);
    const bool whole = options.scale == std::floor(options.scale) && options.scale >= 2 && options.scale <= 6;
    if (!whole && options.scale != 1.5 && options.scale != 1.7) {
        fail(ErrorKind::invalid_argument, "--scale {} is none of 1.5, 1.7, 2, 3, 4, 5, 6", options.scale);
    }
    settings.output_size = {static_cast<int>(settings.render_size.width * options.scale + 0.5),
                            static_cast<int>(settings.render_size.height * options.scale + 0.5)};
    settings.mip_bias = -static_cast<float>(std::log2(options.scale));
    settings.hdr = options.hdr;
    if (!options.no_reference) {
        const int side = static_cast<int>(std::lround(std::sqrt(std::max(0, options.reference_samples))));
        if (side < 1 || side > 64 || side * side != options.reference_samples) {
            fail(ErrorKind::invalid_argument, "--reference-samples {} is not a square number from 1 to 4096",
                 options.reference_samples);
        }
        settings.reference_grid = side;
    } else {
        settings.reference_grid = 0;
    }
    settings.motion_at_centre = options.motion_at == "centre";
    if (!settings.motion_at_centre && options.motion_at != "jittered") {
        fail(ErrorKind::invalid_argument, "--motion-at \"{}\" is neither \"centre\" nor \"jittered\"",
             options.motion_at);
    }
    return settings;
}

void run(const Options& options) {
    if (options.scene != "demo") {
        fail(ErrorKind::invalid_argument, "there is no scene \"{}\"; the built-in one is \"demo\"", options.scene);
    }
    const render::RenderSettings settings = settings_of(options);
    const int jitter_points = parse_jitter(options.jitter);
    check_at_least("--frames", options.frames, 1);
    check_at_least("--first-frame", options.first_frame, 0);
    check_at_least("--path", options.path, 0);

    render::SequenceWriter writer(options.output, settings, options.scale, options.force);
    const render::CameraPath path(options.path);
    const auto scene = render::make_demo_scene(options.path, path);
    Progress progress("rendering");
    for (int i = 0; i < options.frames; ++i) {
        const int frame = options.first_frame + i;
        const Vec2 jitter = jitter_points > 0 ? halton_jitter(frame, jitter_points) : Vec2{};
        writer.add(render::render_frame(*scene, path.frame(frame), jitter, settings), jitter);
        progress.update(static_cast<size_t>(i) + 1, static_cast<size_t>(options.frames));
    }
    writer.finish();
}

}  // namespace

void add_render_command(CLI::App& app) {
    CLI::App* command = app.add_subcommand("render", "Render a sequence of the native layout with the sample renderer");
    const auto options = std::make_shared<Options>();
    command->add_option("--scene", options->scene, "Scene; the built-in one is \"demo\"")->capture_default_str();
    command->add_option("--size", options->size, "Render size")->type_name("WxH")->capture_default_str();
    command->add_option("--scale", options->scale, "Output size over render size: 1.5, 1.7, or 2 to 6")
        ->capture_default_str();
    command->add_option("--frames", options->frames, "How many frames")->capture_default_str();
    command->add_option("--first-frame", options->first_frame, "Where on the path to start")->capture_default_str();
    command
        ->add_option("--path", options->path,
                     "Number from 0 that chooses the camera's path, and what stands and moves in the scene")
        ->capture_default_str();
    command->add_option("--jitter", options->jitter, "halton:N or none")->capture_default_str();
    command
        ->add_option("--motion-at", options->motion_at,
                     "Where motion is sampled: jittered, as the colour is, or centre")
        ->capture_default_str();
    command->add_option("--reference-samples", options->reference_samples, "Samples a reference pixel, a square number")
        ->capture_default_str();
    command->add_flag("--no-reference", options->no_reference, "Leave the reference out");
    command->add_flag("--hdr", options->hdr, "Linear radiance in EXR files; otherwise display-encoded PNG files");
    command->add_flag("--force", options->force, "Replace the sequence that the folder holds");
    command->add_option("-o,--output", options->output, "Folder of the sequence")->required();
    command->footer("Example: clarus render --scene demo --size 480x270 --scale 2 --frames 12 --path 1 -o seq/");
    command->callback([options] { run(*options); });
}

}  // namespace clarus::cli
