#pragma once

#include <array>
#include <optional>
#include <stdexcept>

#include "clarus/stream.h"
#include "runtime/implementation.h"

namespace clarus::runtime {

/// Where the canonical inputs go; what the pipeline does not use has no layout.
struct IngestProblem {
    std::optional<TensorLayout> color, depth, motion, jitter_x, jitter_y, scale, reactive_mask, transparency_mask,
        opaque_color, ui, alpha;
    const StreamOptions* options = nullptr;  // formats, colour space, encodings
};

/// What ingest writes, in the order of its arguments of kind `input`.
inline std::array<const std::optional<TensorLayout>*, 11> destinations(const IngestProblem& problem) {
    return {&problem.color,        &problem.depth, &problem.motion,        &problem.jitter_x,
            &problem.jitter_y,     &problem.scale, &problem.reactive_mask, &problem.transparency_mask,
            &problem.opaque_color, &problem.ui,    &problem.alpha};
}

/// Where a resource goes: a member of `problem`, which is const or not.
auto& layout_of(graph::Resource resource, auto& problem) {
    switch (resource) {
        case graph::Resource::color:
            return problem.color;
        case graph::Resource::depth:
            return problem.depth;
        case graph::Resource::motion:
            return problem.motion;
        case graph::Resource::reactive_mask:
            return problem.reactive_mask;
        case graph::Resource::transparency_mask:
            return problem.transparency_mask;
        case graph::Resource::opaque_color:
            return problem.opaque_color;
        case graph::Resource::ui:
            return problem.ui;
        case graph::Resource::alpha:
            return problem.alpha;
    }
    throw std::logic_error("unknown resource");
}

/// One kernel that reads the caller's images and writes them and the planes of the jitter and the scale in their
/// canonical form (docs/conventions.md), counting invalid motion vectors. Its arguments of kind `input` are what it
/// writes, numbered as `destinations` are. The caller's images begin, and their rows follow, at multiples of their
/// elements' size.
KernelCall ingest(const IngestProblem& problem);

/// Whether a kernel makes the frame's exposure, for ingest and present to read.
inline bool computes_exposure(const StreamOptions& options) {
    return options.exposure_format.has_value() || options.automatic_exposure;
}

/// How many of the caller's colours an automatic exposure is made of, at most, along an axis.
inline constexpr int kExposureSamples = 128;

/// That kernel: from the caller's image, or from what the colours are.
KernelCall exposure(const IngestProblem& problem);

/// The kernel that writes the caller's output from the pipeline's (argument `input` 0): display-encoded, or linear HDR
/// again.
KernelCall present(const TensorLayout& output, const StreamOptions& options);

}  // namespace clarus::runtime
