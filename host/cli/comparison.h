#pragma once

#include <CLI/CLI.hpp>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "cli/sequence_options.h"
#include "metrics/quality.h"

namespace clarus::cli {

/// What results are compared with, and how: the options of every command that compares.
struct ReferenceOptions {
    SequenceOptions sequence;  // or a folder of images of the results' names
    double scale = 2;
    bool linear = false;
    bool flip = false, lpips = false, vmaf = false;
    std::filesystem::path baseline;  // empty: the result that is bicubic's, where there is one

    void add_to(CLI::App& command);          // but for the sequence's path
    void add_reading_to(CLI::App& command);  // of those, what references are read by
};

/// A frame's reference.
struct Reference {
    std::string name;
    std::filesystem::path file;  // empty where a sequence has none (read_frames)
    ColorSpace color_space = ColorSpace::srgb;
    float exposure = 1;
    size_t index = 0;                              // into the sequence's frames
    std::shared_ptr<const io::Sequence> sequence;  // none for a folder of images
};

/// Errors: file where there is none; those of SequenceOptions::read.
std::vector<Reference> read_references(const ReferenceOptions& options);

/// The same; of a sequence without any, all its frames, whose `file` is empty.
std::vector<Reference> read_frames(const ReferenceOptions& options);

/// Display values of an image that is to be compared with the reference.
io::Pixels read_display(const std::filesystem::path& file, const Reference& reference);

struct ComparedResult {
    std::filesystem::path folder;
    std::vector<std::filesystem::path> files;   // of the references, in their order
    std::vector<metrics::FrameQuality> frames;  // likewise
    metrics::SequenceQuality quality;
};

/// The result whose blocks the others' are compared with: the one asked for, or the first of the folders that is
/// bicubic's, by its name or by the report.json in it; none where there is none.
std::optional<std::filesystem::path> baseline_of(std::span<const std::filesystem::path> folders,
                                                 const ReferenceOptions& options);

/// Why figures of places are absent, a line each.
std::vector<std::string> missing_figures(std::span<const std::filesystem::path> folders,
                                         std::span<const Reference> references, const ReferenceOptions& options);

/// Is given a frame's index into the references, and its masks.
using MasksSeen = std::function<void(size_t, const metrics::Masks&)>;

/// Results against references, frame by frame: what there is of them may grow meanwhile.
class Comparison {
  public:
    /// Of these folders. Errors: where a metric that is asked for cannot be had.
    Comparison(std::span<const std::filesystem::path> folders, const ReferenceOptions& options);
    ~Comparison();
    Comparison(const Comparison&) = delete;
    Comparison& operator=(const Comparison&) = delete;

    /// Further references, after those before, of which every folder has the image. Errors: compare's.
    void add(std::span<const Reference> references);
    /// How many are measured, of those that were added.
    size_t measured() const;
    /// Measures the next one, which must have been added; shows its masks. Errors: compare's.
    void measure_next(const MasksSeen& see_masks = {});
    /// Warns of images that no reference was added for, and of colours that are not numbers.
    void warn_of_unused() const;
    void warn_of_colors() const;
    /// Of the frames that are measured, in the order of folders; `files` are of all. With VMAF once, after the last.
    std::vector<ComparedResult> results();

  private:
    struct State;
    std::unique_ptr<State> state_;
};

/// Every figure that the references allow, of all results together; warns of images without a reference. Masks are
/// shown to who wants to see them. Errors: file, naming the image that is missing or does not fit.
std::vector<ComparedResult> compare(std::span<const std::filesystem::path> folders,
                                    std::span<const Reference> references, const ReferenceOptions& options,
                                    const MasksSeen& see_masks = {});

/// {"result": …, "psnr": …, …, "frames": [{"name": …, "psnr": …, …}]}
nlohmann::ordered_json comparison_json(const ComparedResult& result, std::span<const Reference> references);

}  // namespace clarus::cli
