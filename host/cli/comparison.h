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

    void add_to(CLI::App& command);  // but for the sequence's path
};

/// A frame's reference.
struct Reference {
    std::string name;
    std::filesystem::path file;
    ColorSpace color_space = ColorSpace::srgb;
    float exposure = 1;
    size_t index = 0;                              // into the sequence's frames
    std::shared_ptr<const io::Sequence> sequence;  // none for a folder of images
};

/// Errors: file where there is none; those of SequenceOptions::read.
std::vector<Reference> read_references(const ReferenceOptions& options);

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

/// Every figure that the references allow, of all results together; warns of images without a reference. Masks are
/// shown to who wants to see them. Errors: file, naming the image that is missing or does not fit.
std::vector<ComparedResult> compare(std::span<const std::filesystem::path> folders,
                                    std::span<const Reference> references, const ReferenceOptions& options,
                                    const MasksSeen& see_masks = {});

/// {"result": …, "psnr": …, …, "frames": [{"name": …, "psnr": …, …}]}
nlohmann::ordered_json comparison_json(const ComparedResult& result, std::span<const Reference> references);

}  // namespace clarus::cli
