#include <fmt/format.h>

#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "base/error.h"
#include "base/log.h"
#include "cli/commands.h"
#include "cli/image_folder.h"
#include "cli/progress.h"
#include "cli/quality_text.h"
#include "cli/sequence_options.h"
#include "io/image.h"
#include "io/qrisp.h"
#include "metrics/display.h"

namespace clarus::cli {
namespace {

struct CompareOptions {
    std::filesystem::path result;
    SequenceOptions reference;
    double scale = 2;
    bool linear = false;
    bool json = false;
};

struct Reference {
    std::string name;
    std::filesystem::path file;
    ColorSpace color_space = ColorSpace::srgb;
    float exposure = 1;
};

bool is_image_folder(const SequenceOptions& options) {
    return options.layout == io::Layout::guess && std::filesystem::is_directory(options.path) &&
           !std::filesystem::exists(options.path / "sequence.json") && !io::looks_like_qrisp(options.path);
}

std::vector<Reference> read_references(const CompareOptions& options) {
    std::vector<Reference> references;
    if (is_image_folder(options.reference)) {
        for (const auto& [name, file] : images_in(options.reference.path))
            references.push_back({name, file, options.linear ? ColorSpace::linear : ColorSpace::srgb});
        options.reference.frames.cut(references, options.reference.path);
        return references;
    }
    const io::Sequence sequence = options.reference.read(options.scale);
    for (const io::FrameFiles& frame : sequence.frames)
        if (!frame.reference.empty())
            references.push_back({frame.name, frame.reference, sequence.color_space, frame.exposure});
    if (references.empty())
        fail(ErrorKind::file, "no frame of {} has a reference to compare with", options.reference.path.string());
    return references;
}

metrics::FrameQuality measure(const std::filesystem::path& result, const Reference& reference) {
    const auto display = [&](const std::filesystem::path& file) {
        return metrics::display_values(io::read_image(file), reference.color_space, reference.exposure);
    };
    try {
        return metrics::measure(display(result), display(reference.file));
    } catch (const Error& error) {
        if (error.kind() != ErrorKind::invalid_argument) throw;
        fail(ErrorKind::file, "{} against {}: {}", result.string(), reference.file.string(), error.what());
    }
}

// Frames that --frames leaves out are not missed.
void warn_of_unused(const std::map<std::string, std::filesystem::path>& results,
                    const std::vector<Reference>& references, const CompareOptions& options) {
    if (!options.reference.frames.is_all()) return;
    std::map<std::string, std::filesystem::path> unused = results;
    for (const Reference& reference : references) unused.erase(reference.name);
    if (!unused.empty())
        log(LogLevel::warning, "{} of the {} images in {} have no reference in {} and are left out; the first is {}",
            unused.size(), results.size(), options.result.string(), options.reference.path.string(),
            unused.begin()->second.filename().string());
}

void compare(const CompareOptions& options) {
    const std::vector<Reference> references = read_references(options);
    const auto results = images_in(options.result);
    std::vector<std::filesystem::path> files;
    for (const Reference& reference : references)
        files.push_back(require_image(results, reference.name, options.result));
    warn_of_unused(results, references, options);

    std::vector<metrics::FrameQuality> frames;
    Progress progress("comparing");
    for (size_t i = 0; i < references.size(); ++i) {
        frames.push_back(measure(files[i], references[i]));
        progress.update(i + 1, references.size());
    }

    const metrics::SequenceQuality quality = metrics::summarise(frames);
    if (!options.json) {
        fmt::print("{} over {} frames\n", to_text(quality), frames.size());
        return;
    }
    nlohmann::ordered_json json = quality_json(quality);
    for (size_t i = 0; i < frames.size(); ++i) {
        nlohmann::ordered_json frame{{"name", references[i].name}};
        frame.update(quality_json(frames[i]));
        json["frames"].push_back(std::move(frame));
    }
    fmt::print("{}\n", json.dump(2));
}

}  // namespace

void add_compare_command(CLI::App& app) {
    CLI::App& command = *app.add_subcommand("compare", "PSNR and SSIM of upscaled frames against their references");
    const auto options = std::make_shared<CompareOptions>();
    command.add_option("RESULT_DIR", options->result, "Folder of upscaled images")->required();
    command
        .add_option("REFERENCE", options->reference.path,
                    "A sequence that has references, or a folder of images of the same names")
        ->required();
    options->reference.add_to(command);
    command.add_option("--scale", options->scale, "The ratio of an NSS capture")->type_name("S");
    command.add_flag("--linear", options->linear, "With a folder: its images and the result are linear HDR");
    command.add_flag("--json", options->json, "Print JSON, with every frame");
    command.footer(
        "Both are compared as display values in [0, 1]. PSNR and SSIM are means over the frames; the pooled PSNR is\n"
        "that of the mean squared error over all of them.\n\n"
        "Examples:\n"
        "  clarus compare upscaled sequence\n"
        "  clarus compare upscaled sequence/reference --frames :8 --json");
    command.callback([options] { compare(*options); });
}

}  // namespace clarus::cli
