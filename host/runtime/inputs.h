#pragma once

#include <array>
#include <optional>

#include "clarus/stream.h"
#include "runtime/implementation.h"

namespace clarus::runtime {

/// Where the canonical inputs go; what the pipeline does not use has no layout.
struct IngestProblem {
    std::optional<TensorLayout> color, depth, motion, jitter_x, jitter_y, scale;
    const StreamOptions* options = nullptr;  // formats, colour space, encodings
};

/// What ingest writes, in the order of its arguments of kind `input`.
inline std::array<const std::optional<TensorLayout>*, 6> destinations(const IngestProblem& problem) {
    return {&problem.color, &problem.depth, &problem.motion, &problem.jitter_x, &problem.jitter_y, &problem.scale};
}

/// One kernel that reads the caller's images and writes colour, depth, motion and the planes of the jitter and the
/// scale in their canonical form (docs/conventions.md), counting invalid motion vectors. Its arguments of kind `input`
/// are what it writes: 0 colour, 1 depth, 2 motion, 3 jitter_x, 4 jitter_y, 5 scale. The caller's images begin, and
/// their rows follow, at multiples of their elements' size.
KernelCall ingest(const IngestProblem& problem);

/// The kernel that writes the caller's output from the pipeline's (argument `input` 0): display-encoded, or linear HDR
/// again.
KernelCall present(const TensorLayout& output, const StreamOptions& options);

}  // namespace clarus::runtime
