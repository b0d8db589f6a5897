#include "cli/comparison.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <system_error>
#include <utility>

#include "base/error.h"
#include "base/log.h"
#include "cli/image_folder.h"
#include "cli/progress.h"
#include "cli/quality_text.h"
#include "io/file.h"
#include "io/frames.h"
#include "io/image.h"
#include "io/image_folder.h"
#include "io/json_reader.h"
#include "io/qrisp.h"
#include "metrics/display.h"
#include "metrics/if_ssim.h"
#include "metrics/masks.h"
#include "metrics/pixel_std.h"
#include "metrics/python_metric.h"
#include "metrics/radiance.h"
#include "metrics/strred.h"
#include "metrics/vmaf.h"

namespace clarus::cli {
namespace {

bool is_image_folder(const SequenceOptions& options) {
    return options.layout == io::Layout::guess && std::filesystem::is_directory(options.path) &&
           !std::filesystem::exists(options.path / "sequence.json") && !io::looks_like_qrisp(options.path);
}

bool is_cut(const Reference& reference) {
    return reference.sequence && reference.sequence->frames[reference.index].reset;
}

bool has_ground_truth(const Reference& reference) {
    if (!reference.sequence) return false;
    const auto& optional = reference.sequence->frames[reference.index].optional;
    return optional.contains("reference_depth") && optional.contains("reference_motion");
}

bool is_same(const std::filesystem::path& folder, const std::filesystem::path& other) {
    std::error_code none;
    return std::filesystem::equivalent(folder, other, none);
}

// Motion and depth of a reference, where the sequence has them.
std::optional<io::GroundTruth> ground_truth(const Reference& reference) {
    if (!reference.sequence) return std::nullopt;
    return io::read_ground_truth(*reference.sequence, reference.index);
}

io::Pixels display_values(const io::Pixels& image, const Reference& reference) {
    return metrics::display_values(image, reference.color_space, reference.exposure);
}

/// Of the colour: what alpha is does not matter.
bool are_numbers(const io::Pixels& image) {
    for (size_t i = 0; i < image.values.size(); i += image.channels)
        for (int c = 0; c < std::min(image.channels, 3); ++c)
            if (std::isnan(image.values[i + c])) return false;
    return true;
}

/// Headers of references, whose sizes are the sequence's where there is one.
std::vector<io::ImageHeader> headers_of(std::span<const Reference> references) {
    std::vector<io::ImageHeader> headers;
    for (const Reference& reference : references) {
        headers.push_back(io::read_image_header(reference.file));
        if (!reference.sequence) continue;
        const Size is = headers.back().size, expected = reference.sequence->output_size();
        if (is != expected)
            fail(ErrorKind::file, "{} has {}x{} pixels where the sequence has {}x{} for the reference",
                 reference.file.string(), is.width, is.height, expected.width, expected.height);
    }
    return headers;
}

bool is_bicubic(const std::filesystem::path& folder) {
    if (name_of(folder) == "bicubic") return true;
    const std::filesystem::path file = folder / "report.json";
    if (!std::filesystem::exists(file)) return false;
    const auto report = io::try_parse_json(io::read_file(file));
    const nlohmann::json::json_pointer name("/model/name");
    return report && report->contains(name) && (*report)[name] == "bicubic";
}

// What one result's frames are measured with; `inter_frame` and `is_static` are of this frame and the one before it.
struct Measure {
    const Reference& reference;
    const io::Pixels& expected;
    const std::optional<io::Pixels>& expected_radiance;  // of linear sequences
    const std::optional<metrics::InterFrame>& inter_frame;
    const metrics::Masks* masks;  // null where there are none
    bool is_static;
    const metrics::StrredFrame& expected_strred;
    bool has_previous;  // the frame before, and no cut between
    std::optional<metrics::PythonMetric>&flip, &lpips;
};

// One of the folders, measured frame by frame.
class Result {
  public:
    Result(const std::filesystem::path& folder, std::span<const Reference> references, bool with_vmaf)
        : images_(io::images_in(folder)) {
        if (with_vmaf) vmaf_ = std::make_unique<metrics::Vmaf>();
        compared_.folder = folder;
        for (const Reference& reference : references)
            compared_.files.push_back(require_image(images_, reference.name, folder));
    }

    void add(const Measure& with) {
        const std::filesystem::path& file = compared_.files[compared_.frames.size()];
        const io::Pixels image = io::read_image(file);
        io::Pixels pixels = display_values(image, with.reference);
        const bool had_numbers = std::exchange(has_numbers_, are_numbers(image));
        frames_without_numbers_ += !has_numbers_;
        try {
            metrics::FrameQuality quality = metrics::measure(pixels, with.expected, with.masks);
            if (with.inter_frame && has_numbers_ && had_numbers)
                quality.if_ssim = with.inter_frame->ssim(previous_, pixels);
            if (with.expected_radiance)
                quality.radiance = metrics::measure_radiance(metrics::exposed_radiance(image, with.reference.exposure),
                                                             *with.expected_radiance);
            if (with.flip) quality.flip = with.flip->measure(pixels, with.expected);
            if (with.lpips) quality.lpips = with.lpips->measure(pixels, with.expected);
            if (vmaf_) vmaf_->add(pixels, with.expected);
            add_strred(pixels, with, quality);
            pixel_std_.add(pixels, with.is_static);
            compared_.frames.push_back(quality);
        } catch (const Error& error) {
            if (error.kind() != ErrorKind::invalid_argument) throw;
            fail(ErrorKind::file, "{} against {}: {}", file.string(), with.reference.file.string(), error.what());
        }
        previous_ = std::move(pixels);
    }

    /// Of every image, before any pixel is read: a small file may claim to be a large picture.
    void check_sizes(std::span<const Reference> references, std::span<const io::ImageHeader> headers) const {
        for (size_t i = 0; i < references.size(); ++i) {
            const Size is = io::read_image_header(compared_.files[i]).size, expected = headers[i].size;
            if (is != expected)
                fail(ErrorKind::file, "{} against {}: {}x{} pixels cannot be compared with a reference of {}x{}",
                     compared_.files[i].string(), references[i].file.string(), is.width, is.height, expected.width,
                     expected.height);
        }
    }

    void warn_of_colors() const {
        if (frames_without_numbers_ > 0)
            log(LogLevel::warning,
                "{} of the {} images in {} have colours that are not numbers (NaN), which count as 0; these frames "
                "have no IF-SSIM",
                frames_without_numbers_, compared_.frames.size(), compared_.folder.string());
    }

    const std::vector<metrics::FrameQuality>& frames() const { return compared_.frames; }

    void compare_blocks(std::span<const metrics::FrameQuality> baseline) {
        metrics::compare_blocks(compared_.frames, baseline);
    }

    ComparedResult take() {
        if (vmaf_) {
            const std::vector<double> figures = vmaf_->finish();
            for (size_t i = 0; i < figures.size(); ++i) compared_.frames[i].vmaf = figures[i];
        }
        compared_.quality = metrics::summarise(compared_.frames);
        compared_.quality.pixel_std = pixel_std_.mean();
        return std::move(compared_);
    }

    // Frames that --frames leaves out are not missed.
    void warn_of_unused(std::span<const Reference> references, const SequenceOptions& options) const {
        if (!options.frames.is_all()) return;
        std::map<std::string, std::filesystem::path> unused = images_;
        for (const Reference& reference : references) {
            unused.erase(reference.name);
            unused.erase(name_before(reference.name));  // which has none, and is not missed
        }
        if (!unused.empty())
            log(LogLevel::warning,
                "{} of the {} images in {} have no reference in {} and are left out; the first is {}", unused.size(),
                images_.size(), compared_.folder.string(), options.path.string(),
                unused.begin()->second.filename().string());
    }

  private:
    void add_strred(const io::Pixels& pixels, const Measure& with, metrics::FrameQuality& quality) {
        metrics::StrredFrame now = metrics::strred_frame(pixels, with.has_previous ? &strred_ : nullptr);
        quality.srred = metrics::entropic_difference(now.spatial, with.expected_strred.spatial);
        quality.trred = metrics::entropic_difference(now.temporal, with.expected_strred.temporal);
        strred_ = std::move(now);
    }

    std::map<std::string, std::filesystem::path> images_;
    ComparedResult compared_;
    metrics::PixelStd pixel_std_;
    metrics::StrredFrame strred_;
    std::unique_ptr<metrics::Vmaf> vmaf_;
    io::Pixels previous_;
    bool has_numbers_ = true;  // of the last image
    size_t frames_without_numbers_ = 0;
};

}  // namespace

void ReferenceOptions::add_to(CLI::App& command) {
    sequence.add_to(command);
    command.add_option("--scale", scale, "The ratio of an NSS capture")->type_name("S");
    command.add_flag("--linear", linear, "With a folder: its images and the results are linear HDR");
    command.add_flag("--flip", flip,
                     "FLIP, too, by NVIDIA's flip-evaluator (PyPI), which the python3 in the path must have");
    command.add_flag("--lpips", lpips,
                     "LPIPS, too, by its authors' package (PyPI's lpips), which the python3 in the path must have with "
                     "torchvision's weights of AlexNet");
    command.add_flag(
        "--vmaf", vmaf,
        "VMAF, too, by an FFmpeg with libvmaf: that of PyPI's imageio-ffmpeg, which the python3 in the path "
        "must have, or the one in the path");
    command
        .add_option(
            "--baseline", baseline,
            "The result whose blocks the others' are compared with, one of them or another; where not given the "
            "one that is bicubic's, by its folder's name or report.json")
        ->type_name("FOLDER");
}

std::vector<Reference> read_references(const ReferenceOptions& options) {
    std::vector<Reference> references;
    const std::filesystem::path& path = options.sequence.path;
    if (is_image_folder(options.sequence)) {
        const ColorSpace color_space = options.linear ? ColorSpace::linear : ColorSpace::srgb;
        for (const auto& [name, file] : io::images_in(path))
            references.push_back({name, file, color_space, 1, references.size(), nullptr});
        options.sequence.frames.cut(references, path);
        return references;
    }
    const auto sequence = std::make_shared<const io::Sequence>(options.sequence.read(options.scale));
    for (size_t i = 0; i < sequence->frames.size(); ++i) {
        const io::FrameFiles& frame = sequence->frames[i];
        if (!frame.reference.empty())
            references.push_back({frame.name, frame.reference, sequence->color_space, frame.exposure, i, sequence});
    }
    if (references.empty()) fail(ErrorKind::file, "no frame of {} has a reference to compare with", path.string());
    return references;
}

io::Pixels read_display(const std::filesystem::path& file, const Reference& reference) {
    return display_values(io::read_image(file), reference);
}

std::optional<std::filesystem::path> baseline_of(std::span<const std::filesystem::path> folders,
                                                 const ReferenceOptions& options) {
    if (!options.baseline.empty()) return options.baseline;
    const auto found = std::ranges::find_if(folders, is_bicubic);
    return found == folders.end() ? std::nullopt : std::optional(*found);
}

std::vector<std::string> missing_figures(std::span<const std::filesystem::path> folders,
                                         std::span<const Reference> references, const ReferenceOptions& options) {
    std::vector<std::string> lines;
    if (!std::ranges::any_of(references, has_ground_truth))
        lines.push_back(references.front().sequence
                            ? "No figures in masks: the sequence has no reference_depth and reference_motion (clarus "
                              "render --output-buffers)."
                            : "No figures in masks: a folder of images has no depth and motion.");
    const auto baseline = baseline_of(folders, options);
    if (!baseline)
        lines.push_back("No worse blocks: none of the results is bicubic's, and no --baseline is given.");
    else if (folders.size() == 1 && is_same(folders.front(), *baseline))
        lines.push_back("No worse blocks: the only result is the baseline.");
    return lines;
}

std::vector<ComparedResult> compare(std::span<const std::filesystem::path> folders,
                                    std::span<const Reference> references, const ReferenceOptions& options,
                                    const MasksSeen& see_masks) {
    std::vector<Result> results;
    for (const std::filesystem::path& folder : folders) results.emplace_back(folder, references, options.vmaf);
    for (const Result& result : results) result.warn_of_unused(references, options.sequence);
    const std::optional<std::filesystem::path> baseline_folder = baseline_of(folders, options);
    std::optional<size_t> baseline;
    if (baseline_folder) {
        const auto same = [&](const std::filesystem::path& folder) { return is_same(folder, *baseline_folder); };
        baseline = std::ranges::find_if(folders, same) - folders.begin();
        if (*baseline == folders.size()) results.emplace_back(*baseline_folder, references, false);
    }
    const std::vector<io::ImageHeader> headers = headers_of(references);
    for (const Result& result : results) result.check_sizes(references, headers);
    std::optional<metrics::PythonMetric> flip, lpips;
    if (options.flip) flip.emplace(metrics::flip_package);
    if (options.lpips) lpips.emplace(metrics::lpips_package);

    struct Expected {
        io::Pixels pixels;
        std::optional<io::GroundTruth> truth;
        metrics::StrredFrame strred;
    } previous;
    std::optional<metrics::MaskMaker> masks_of;
    if (const auto& sequence = references.front().sequence) masks_of.emplace(sequence->output_scale());
    Progress progress("comparing");
    for (size_t i = 0; i < references.size(); ++i) {
        const Reference& reference = references[i];
        const io::Pixels image = io::read_image(reference.file);
        Expected current{display_values(image, reference), ground_truth(reference), {}};
        std::optional<io::Pixels> radiance;
        if (reference.color_space == ColorSpace::linear)
            radiance = metrics::exposed_radiance(image, reference.exposure);
        const bool follows = i > 0 && reference.index == references[i - 1].index + 1;
        std::optional<metrics::InterFrame> inter_frame;
        const bool has_previous = follows && !is_cut(reference);
        const bool knows_motion = has_previous && previous.truth && current.truth;
        current.strred = metrics::strred_frame(current.pixels, has_previous ? &previous.strred : nullptr);
        std::optional<metrics::Masks> masks;
        if (current.truth) masks = masks_of->add(*current.truth, knows_motion);
        if (masks && see_masks) see_masks(i, *masks);
        if (knows_motion) inter_frame.emplace(previous.pixels, previous.truth->depth, current.pixels, *current.truth);
        const bool is_static = follows && current.pixels.values == previous.pixels.values;
        for (Result& result : results)
            result.add({reference, current.pixels, radiance, inter_frame, masks ? &*masks : nullptr, is_static,
                        current.strred, has_previous, flip, lpips});
        previous = std::move(current);
        progress.update(i + 1, references.size());
    }

    for (const Result& result : results) result.warn_of_colors();
    for (size_t i = 0; baseline && i < folders.size(); ++i)
        if (i != *baseline) results[i].compare_blocks(results[*baseline].frames());
    std::vector<ComparedResult> compared;
    for (size_t i = 0; i < folders.size(); ++i) compared.push_back(results[i].take());
    return compared;
}

nlohmann::ordered_json comparison_json(const ComparedResult& result, std::span<const Reference> references) {
    nlohmann::ordered_json json{{"result", result.folder.string()}};
    json.update(quality_json(result.quality));
    for (size_t i = 0; i < result.frames.size(); ++i) {
        nlohmann::ordered_json frame{{"name", references[i].name}};
        frame.update(quality_json(result.frames[i]));
        json["frames"].push_back(std::move(frame));
    }
    return json;
}

}  // namespace clarus::cli
