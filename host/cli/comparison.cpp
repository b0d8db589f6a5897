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

/// A reference's size, which is the sequence's where there is one.
Size size_of(const Reference& reference) {
    const Size is = io::read_image_header(reference.file).size;
    if (!reference.sequence) return is;
    const Size expected = reference.sequence->output_size();
    if (is != expected)
        fail(ErrorKind::file, "{} has {}x{} pixels where the sequence has {}x{} for the reference",
             reference.file.string(), is.width, is.height, expected.width, expected.height);
    return is;
}

bool is_bicubic(const std::filesystem::path& folder) {
    if (name_of(folder) == "bicubic") return true;
    const std::filesystem::path file = folder / "report.json";
    if (!std::filesystem::exists(file)) return false;
    const auto report = io::try_parse_json(io::read_file(file, io::largest_json));
    const nlohmann::json::json_pointer name("/model/name");
    if (!report || !report->contains(name)) return false;
    const nlohmann::json& model = (*report)[name];
    return model.is_string() && model.get_ref<const std::string&>() == "bicubic";
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
    Result(const std::filesystem::path& folder, bool with_vmaf) {
        if (with_vmaf) vmaf_ = std::make_unique<metrics::Vmaf>();
        compared_.folder = folder;
    }

    const std::filesystem::path& folder() const { return compared_.folder; }

    void find(std::span<const Reference> references) {
        images_ = io::images_in(folder());
        for (const Reference& reference : references)
            compared_.files.push_back(require_image(images_, reference.name, folder()));
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

    /// Of an image, before any pixel is read: a small file may claim to be a large picture.
    void check_size(size_t index, const Reference& reference, Size expected) const {
        const Size is = io::read_image_header(compared_.files[index]).size;
        if (is != expected)
            fail(ErrorKind::file, "{} against {}: {}x{} pixels cannot be compared with a reference of {}x{}",
                 compared_.files[index].string(), reference.file.string(), is.width, is.height, expected.width,
                 expected.height);
    }

    void warn_of_colors() const {
        if (frames_without_numbers_ > 0)
            log(LogLevel::warning,
                "{} of the {} images in {} have colours that are not numbers (NaN), which count as 0; these frames "
                "have no IF-SSIM",
                frames_without_numbers_, compared_.frames.size(), compared_.folder.string());
    }

    const std::vector<metrics::FrameQuality>& frames() const { return compared_.frames; }

    void finish_vmaf() {
        if (!vmaf_) return;
        const std::vector<double> figures = vmaf_->finish();
        for (size_t i = 0; i < figures.size(); ++i) compared_.frames[i].vmaf = figures[i];
        vmaf_.reset();
    }

    /// `baseline`: whose blocks are compared with; empty for none.
    ComparedResult summary(std::span<const metrics::FrameQuality> baseline) const {
        ComparedResult result = compared_;
        if (!baseline.empty()) metrics::compare_blocks(result.frames, baseline);
        result.quality = metrics::summarise(result.frames);
        result.quality.pixel_std = pixel_std_.mean();
        return result;
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

void ReferenceOptions::add_reading_to(CLI::App& command) {
    sequence.add_to(command);
    command.add_option("--scale", scale, "The ratio of an NSS capture")->type_name("S");
    command.add_flag("--linear", linear, "With a folder: its images and the results are linear HDR");
}

void ReferenceOptions::add_to(CLI::App& command) {
    add_reading_to(command);
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

std::vector<Reference> read_frames(const ReferenceOptions& options) {
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
    const bool any =
        std::ranges::any_of(sequence->frames, [](const io::FrameFiles& frame) { return !frame.reference.empty(); });
    for (size_t i = 0; i < sequence->frames.size(); ++i) {
        const io::FrameFiles& frame = sequence->frames[i];
        if (!any || !frame.reference.empty())
            references.push_back({frame.name, frame.reference, sequence->color_space, frame.exposure, i, sequence});
    }
    return references;
}

std::vector<Reference> read_references(const ReferenceOptions& options) {
    std::vector<Reference> references = read_frames(options);
    if (references.front().file.empty())
        fail(ErrorKind::file, "no frame of {} has a reference to compare with", options.sequence.path.string());
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
        lines.push_back(
            "Blocks worse than a baseline's are not counted: none of the results is bicubic's, and no --baseline is "
            "given.");
    else if (folders.size() == 1 && is_same(folders.front(), *baseline))
        lines.push_back("Blocks worse than a baseline's are not counted: the only result is the baseline.");
    return lines;
}

struct Comparison::State {
    struct Expected {
        io::Pixels pixels;
        std::optional<io::GroundTruth> truth;
        metrics::StrredFrame strred;
    };

    ReferenceOptions options;
    size_t asked;  // of the results: a baseline that is none of them is behind
    std::vector<Result> results;
    std::optional<size_t> baseline;
    std::vector<Reference> references;
    std::optional<metrics::PythonMetric> flip, lpips;
    std::optional<metrics::MaskMaker> masks_of;
    Expected previous;
    size_t measured = 0;
};

Comparison::Comparison(std::span<const std::filesystem::path> folders, const ReferenceOptions& options)
    : state_(std::make_unique<State>()) {
    State& state = *state_;
    state.options = options;
    state.asked = folders.size();
    for (const std::filesystem::path& folder : folders) state.results.emplace_back(folder, options.vmaf);
    if (const auto baseline = baseline_of(folders, options)) {
        const auto same = [&](const std::filesystem::path& folder) { return is_same(folder, *baseline); };
        state.baseline = std::ranges::find_if(folders, same) - folders.begin();
        if (*state.baseline == folders.size()) state.results.emplace_back(*baseline, false);
    }
    if (options.flip) state.flip.emplace(metrics::flip_package);
    if (options.lpips) state.lpips.emplace(metrics::lpips_package);
}

Comparison::~Comparison() = default;

void Comparison::add(std::span<const Reference> references) {
    State& state = *state_;
    if (references.empty()) return;
    for (Result& result : state.results) result.find(references);
    for (const Reference& reference : references) {
        const Size size = size_of(reference);
        for (const Result& result : state.results) result.check_size(state.references.size(), reference, size);
        state.references.push_back(reference);
    }
    if (const auto& sequence = references.front().sequence; sequence && !state.masks_of)
        state.masks_of.emplace(sequence->output_scale());
}

size_t Comparison::measured() const { return state_->measured; }

void Comparison::measure_next(const MasksSeen& see_masks) {
    State& state = *state_;
    const size_t i = state.measured;
    const Reference& reference = state.references.at(i);
    const State::Expected& previous = state.previous;
    const io::Pixels image = io::read_image(reference.file);
    State::Expected current{display_values(image, reference), ground_truth(reference), {}};
    std::optional<io::Pixels> radiance;
    if (reference.color_space == ColorSpace::linear) radiance = metrics::exposed_radiance(image, reference.exposure);
    const bool follows = i > 0 && reference.index == state.references[i - 1].index + 1;
    std::optional<metrics::InterFrame> inter_frame;
    const bool has_previous = follows && !is_cut(reference);
    const bool knows_motion = has_previous && previous.truth && current.truth;
    current.strred = metrics::strred_frame(current.pixels, has_previous ? &previous.strred : nullptr);
    std::optional<metrics::Masks> masks;
    if (current.truth) masks = state.masks_of->add(*current.truth, knows_motion);
    if (masks && see_masks) see_masks(i, *masks);
    if (knows_motion) inter_frame.emplace(previous.pixels, previous.truth->depth, current.pixels, *current.truth);
    const bool is_static = follows && current.pixels.values == previous.pixels.values;
    for (Result& result : state.results)
        result.add({reference, current.pixels, radiance, inter_frame, masks ? &*masks : nullptr, is_static,
                    current.strred, has_previous, state.flip, state.lpips});
    state.previous = std::move(current);
    ++state.measured;
}

void Comparison::warn_of_unused() const {
    for (size_t i = 0; i < state_->asked; ++i)
        state_->results[i].warn_of_unused(state_->references, state_->options.sequence);
}

void Comparison::warn_of_colors() const {
    for (const Result& result : state_->results) result.warn_of_colors();
}

std::vector<ComparedResult> Comparison::results() {
    std::vector<ComparedResult> compared;
    for (size_t i = 0; i < state_->asked; ++i) {
        state_->results[i].finish_vmaf();
        const bool has_baseline = state_->baseline && *state_->baseline != i;
        compared.push_back(state_->results[i].summary(has_baseline
                                                          ? std::span(state_->results[*state_->baseline].frames())
                                                          : std::span<const metrics::FrameQuality>()));
    }
    return compared;
}

std::vector<ComparedResult> compare(std::span<const std::filesystem::path> folders,
                                    std::span<const Reference> references, const ReferenceOptions& options,
                                    const MasksSeen& see_masks) {
    Comparison comparison(folders, options);
    comparison.add(references);
    comparison.warn_of_unused();
    Progress progress("comparing");
    while (comparison.measured() < references.size()) {
        comparison.measure_next(see_masks);
        progress.update(comparison.measured(), references.size());
    }
    comparison.warn_of_colors();
    return comparison.results();
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
