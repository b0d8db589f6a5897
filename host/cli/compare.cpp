#include <fmt/format.h>
#include <unistd.h>

#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/error.h"
#include "base/log.h"
#include "cli/commands.h"
#include "cli/image_folder.h"
#include "cli/progress.h"
#include "cli/quality_text.h"
#include "cli/sequence_options.h"
#include "io/frames.h"
#include "io/image.h"
#include "io/qrisp.h"
#include "metrics/display.h"
#include "metrics/flip.h"
#include "metrics/if_ssim.h"
#include "metrics/pixel_std.h"

namespace clarus::cli {
namespace {

enum class Form { text, json, csv };

struct CompareOptions {
    std::vector<std::filesystem::path> results;
    SequenceOptions reference;
    double scale = 2;
    bool linear = false;
    bool flip = false;
    Form form = Form::text;
};

struct Reference {
    std::string name;
    std::filesystem::path file;
    ColorSpace color_space = ColorSpace::srgb;
    float exposure = 1;
    size_t index = 0;                              // into the sequence's frames
    std::shared_ptr<const io::Sequence> sequence;  // none for a folder of images

    bool follows(const Reference& other) const { return index == other.index + 1; }
    bool is_cut() const { return sequence && sequence->frames[index].reset; }
};

bool is_image_folder(const SequenceOptions& options) {
    return options.layout == io::Layout::guess && std::filesystem::is_directory(options.path) &&
           !std::filesystem::exists(options.path / "sequence.json") && !io::looks_like_qrisp(options.path);
}

std::vector<Reference> read_references(const CompareOptions& options) {
    std::vector<Reference> references;
    if (is_image_folder(options.reference)) {
        const ColorSpace color_space = options.linear ? ColorSpace::linear : ColorSpace::srgb;
        for (const auto& [name, file] : images_in(options.reference.path))
            references.push_back({name, file, color_space, 1, references.size(), nullptr});
        options.reference.frames.cut(references, options.reference.path);
        return references;
    }
    const auto sequence = std::make_shared<const io::Sequence>(options.reference.read(options.scale));
    for (size_t i = 0; i < sequence->frames.size(); ++i) {
        const io::FrameFiles& frame = sequence->frames[i];
        if (!frame.reference.empty())
            references.push_back({frame.name, frame.reference, sequence->color_space, frame.exposure, i, sequence});
    }
    if (references.empty())
        fail(ErrorKind::file, "no frame of {} has a reference to compare with", options.reference.path.string());
    return references;
}

io::Pixels read_display(const std::filesystem::path& file, const Reference& reference) {
    return metrics::display_values(io::read_image(file), reference.color_space, reference.exposure);
}

// One of the folders, measured frame by frame.
class Result {
  public:
    Result(std::filesystem::path folder, const std::vector<Reference>& references)
        : folder_(std::move(folder)), images_(images_in(folder_)) {
        for (const Reference& reference : references) files_.push_back(require_image(images_, reference.name, folder_));
    }

    // `inter_frame` and `is_static`: of this frame and the one before it.
    void measure(const Reference& reference, const io::Pixels& expected,
                 const std::optional<metrics::InterFrame>& inter_frame, bool is_static, metrics::Flip* flip) {
        const std::filesystem::path& file = files_[frames_.size()];
        io::Pixels pixels = read_display(file, reference);
        try {
            metrics::FrameQuality quality = metrics::measure(pixels, expected);
            if (inter_frame) quality.if_ssim = inter_frame->ssim(previous_, pixels);
            if (flip) quality.flip = flip->mean(pixels, expected);
            pixel_std_.add(pixels, is_static);
            frames_.push_back(quality);
        } catch (const Error& error) {
            if (error.kind() != ErrorKind::invalid_argument) throw;
            fail(ErrorKind::file, "{} against {}: {}", file.string(), reference.file.string(), error.what());
        }
        previous_ = std::move(pixels);
    }

    NamedQuality quality() const {
        metrics::SequenceQuality overall = metrics::summarise(frames_);
        overall.pixel_std = pixel_std_.mean();
        return {folder_.string(), overall};
    }

    nlohmann::ordered_json json(const std::vector<Reference>& references) const {
        nlohmann::ordered_json json{{"result", folder_.string()}};
        json.update(quality_json(quality().quality));
        for (size_t i = 0; i < frames_.size(); ++i) {
            nlohmann::ordered_json frame{{"name", references[i].name}};
            frame.update(quality_json(frames_[i]));
            json["frames"].push_back(std::move(frame));
        }
        return json;
    }

    // Frames that --frames leaves out are not missed.
    void warn_of_unused(const std::vector<Reference>& references, const CompareOptions& options) const {
        if (!options.reference.frames.is_all()) return;
        std::map<std::string, std::filesystem::path> unused = images_;
        for (const Reference& reference : references) unused.erase(reference.name);
        if (!unused.empty())
            log(LogLevel::warning,
                "{} of the {} images in {} have no reference in {} and are left out; the first is {}", unused.size(),
                images_.size(), folder_.string(), options.reference.path.string(),
                unused.begin()->second.filename().string());
    }

  private:
    std::filesystem::path folder_;
    std::map<std::string, std::filesystem::path> images_;
    std::vector<std::filesystem::path> files_;  // of the references, in their order
    std::vector<metrics::FrameQuality> frames_;
    metrics::PixelStd pixel_std_;
    io::Pixels previous_;
};

// Motion and depth of a frame's reference, where the sequence has them.
std::optional<io::GroundTruth> ground_truth(const Reference& reference) {
    if (!reference.sequence) return std::nullopt;
    return io::read_ground_truth(*reference.sequence, reference.index);
}

void measure(std::vector<Result>& results, const std::vector<Reference>& references, bool with_flip) {
    std::optional<metrics::Flip> flip;
    if (with_flip) flip.emplace();
    struct Expected {
        io::Pixels reference;
        std::optional<io::GroundTruth> truth;
    } previous;
    Progress progress("comparing");
    for (size_t i = 0; i < references.size(); ++i) {
        const Reference& reference = references[i];
        Expected current{read_display(reference.file, reference), ground_truth(reference)};
        const bool follows = i > 0 && reference.follows(references[i - 1]);
        const bool is_static = follows && current.reference.values == previous.reference.values;
        std::optional<metrics::InterFrame> inter_frame;
        if (follows && !reference.is_cut() && previous.truth && current.truth)
            inter_frame.emplace(previous.reference, previous.truth->depth, current.reference, *current.truth);
        for (Result& result : results)
            result.measure(reference, current.reference, inter_frame, is_static, flip ? &*flip : nullptr);
        previous = std::move(current);
        progress.update(i + 1, references.size());
    }
}

void print(const std::vector<Result>& results, const std::vector<Reference>& references, Form form) {
    std::vector<NamedQuality> rows;
    nlohmann::ordered_json json;
    for (const Result& result : results) {
        rows.push_back(result.quality());
        json.push_back(result.json(references));
    }
    if (form == Form::json)
        fmt::print("{}\n", (json.size() == 1 ? json[0] : json).dump(2));
    else if (form == Form::csv)
        fmt::print("{}", quality_csv(rows));
    else if (rows.size() == 1)
        fmt::print("{} over {} frames\n", to_text(rows[0].quality), references.size());
    else
        fmt::print("{}", quality_table(rows, isatty(STDOUT_FILENO)));
}

void compare(const CompareOptions& options) {
    const std::vector<Reference> references = read_references(options);
    std::vector<Result> results;
    for (const std::filesystem::path& folder : options.results) results.emplace_back(folder, references);
    for (const Result& result : results) result.warn_of_unused(references, options);
    measure(results, references, options.flip);
    print(results, references, options.form);
}

}  // namespace

void add_compare_command(CLI::App& app) {
    CLI::App& command = *app.add_subcommand("compare", "How near upscaled frames come to their references");
    const auto options = std::make_shared<CompareOptions>();
    const auto set_folders = [options](std::vector<std::filesystem::path> folders) {
        options->reference.path = folders.back();
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
    command.add_option("--scale", options->scale, "The ratio of an NSS capture")->type_name("S");
    command.add_flag("--linear", options->linear, "With a folder: its images and the results are linear HDR");
    command.add_flag("--flip", options->flip,
                     "FLIP, too, by NVIDIA's flip-evaluator (PyPI), which the python3 in the path must have");
    CLI::Option& json = *command.add_flag_callback(
        "--json", [options] { options->form = Form::json; },
        "Print JSON, with every frame: an object, or a list of them where there are several results");
    command
        .add_flag_callback(
            "--csv", [options] { options->form = Form::csv; }, "Print CSV, a line a result")
        ->excludes(&json);
    command.footer(
        "Both are compared as display values in [0, 1]. PSNR, SSIM and FLIP are means over the frames; the pooled "
        "PSNR\n"
        "is that of the mean squared error over all of them. Two figures are of stability in time, and are there "
        "where\n"
        "the sequence is such that they can be:\n"
        "  IF-SSIM    similarity of consecutive frames, aligned by the renderer's motion, where the reference does "
        "not\n"
        "             change. It needs motion and depth of output pixels: clarus render --output-buffers writes them;\n"
        "             those of render pixels are not taken in their place\n"
        "  pixel std  temporal standard deviation, in 8-bit levels, of the pixels of static segments: runs of frames\n"
        "             whose references are the same, bit for bit\n\n"
        "Examples:\n"
        "  clarus compare upscaled sequence\n"
        "  clarus compare bicubic taau enss sequence          one table, the best in bold\n"
        "  clarus compare bicubic enss sequence --csv > quality.csv\n"
        "  clarus compare upscaled sequence/reference --frames :8 --json");
    command.callback([options] { compare(*options); });
}

}  // namespace clarus::cli
