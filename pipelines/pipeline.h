#pragma once

#include <optional>
#include <span>
#include <string_view>

#include "graph/graph.h"
#include "io/safetensors.h"

namespace clarus::pipelines {

/// What is left to the user of a model.
struct PipelineOptions {
    std::optional<int> previous_frames;  // nsrr: use so many instead of all that the model has
};

/// A published system: a model's tensors in, a graph out. What a model file must hold is said in formats.md.
struct Pipeline {
    std::string_view name;  // the model's `pipeline`
    int smallest_scale, largest_scale;
    bool needs_motion;
    /// Errors: file, naming the tensor or key that does not fit.
    graph::Graph (*build)(const io::Safetensors& model, int scale, Size render, const PipelineOptions& options);
};

std::span<const Pipeline> pipelines();

/// A filter without a network.
struct FilterPipeline {
    std::string_view name;
    graph::Graph (*build)(double scale, Size render, Size output);
};

std::span<const FilterPipeline> filters();

// One folder each.
graph::Graph build_enss(const io::Safetensors& model, int scale, Size render, const PipelineOptions& options);
graph::Graph build_nsrr(const io::Safetensors& model, int scale, Size render, const PipelineOptions& options);
graph::Graph build_mnss(const io::Safetensors& model, int scale, Size render, const PipelineOptions& options);
graph::Graph build_srpo(const io::Safetensors& model, int scale, Size render, const PipelineOptions& options);
graph::Graph build_nearest(double scale, Size render, Size output);
graph::Graph build_bilinear(double scale, Size render, Size output);
graph::Graph build_bicubic(double scale, Size render, Size output);
graph::Graph build_lanczos(double scale, Size render, Size output);

}  // namespace clarus::pipelines
