#pragma once

#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "clarus/model.h"
#include "graph/graph.h"
#include "io/safetensors.h"

namespace clarus::pipelines {

/// The value of every option that a pipeline declares, by name.
using PipelineOptions = std::map<std::string, double>;

/// A system with a network: a model's tensors in, a graph out. What a model file must hold: docs/formats.md, "A model".
struct Pipeline {
    std::string_view name;  // the model's `pipeline`
    double smallest_scale, largest_scale;
    /// At one of these scales. Errors: file, naming the tensor or key that does not fit.
    graph::Graph (*build)(const io::Safetensors& model, double scale, Size render, const PipelineOptions& options);
    bool any_scale = false;  // the model's `scale` may be "any", and any real one of these will do; else it is whole
    /// A tensor by which a file that others published without metadata is known; empty where there is none.
    std::string_view mark = {};
    std::vector<PipelineOption> options = {};
    /// Whether results are those of frames without jitter.
    bool takes_jitter_out = true;
    /// Of one for any scale: scales up to which graphs have the same nodes, which they have not from there on; nor at
    /// them.
    std::vector<double> turning_points = {};
};

std::span<const Pipeline> pipelines();
/// Pipeline::takes_jitter_out of the one of this name; true of filters.
bool takes_jitter_out(std::string_view name);
/// Pipeline::turning_points of the one of this name; filters have none.
std::span<const double> turning_points(std::string_view name);

/// Errors: file, of metadata whose key is nearly that of one that the file lacks.
void refuse_misspelt_metadata(const io::Safetensors& model);
/// The pipeline that a model file is for: its metadata say so, or a tensor that only one pipeline's files have.
/// Errors: file.
const Pipeline& pipeline_of(const io::Safetensors& model);
/// The model's own scale, or the pipeline's range: of a file that says "any", or was published without metadata.
/// Errors: file.
ScaleRange scales_of(const io::Safetensors& model, const Pipeline& pipeline);
/// The pipeline's options, within what the model allows. Errors: file.
std::vector<PipelineOption> options_of(const io::Safetensors& model, const Pipeline& pipeline);

struct FilterSettings {
    double scale;
    Size render, output;
    const PipelineOptions& options;
};

/// A filter without a network.
struct FilterPipeline {
    std::string_view name;
    graph::Graph (*build)(const FilterSettings& settings);
    std::vector<PipelineOption> options = {};
};

std::span<const FilterPipeline> filters();

// One folder each.
graph::Graph build_clarus(const io::Safetensors& model, double scale, Size render, const PipelineOptions& options);
graph::Graph build_enss(const io::Safetensors& model, int scale, Size render, const PipelineOptions& options);
graph::Graph build_nsrr(const io::Safetensors& model, int scale, Size render, const PipelineOptions& options);
graph::Graph build_mnss(const io::Safetensors& model, int scale, Size render, const PipelineOptions& options);
graph::Graph build_nss(const io::Safetensors& model, double scale, Size render, const PipelineOptions& options);
graph::Graph build_srpo(const io::Safetensors& model, int scale, Size render, const PipelineOptions& options);
graph::Graph build_stack(const io::Safetensors& model, int scale, Size render, const PipelineOptions& options);
graph::Graph build_nearest(const FilterSettings& settings);
graph::Graph build_bilinear(const FilterSettings& settings);
graph::Graph build_bicubic(const FilterSettings& settings);
graph::Graph build_lanczos(const FilterSettings& settings);
graph::Graph build_fsr1(const FilterSettings& settings);
graph::Graph build_fsr2(const FilterSettings& settings);
std::vector<PipelineOption> nsrr_options();
std::vector<PipelineOption> fsr1_options();
std::vector<PipelineOption> fsr2_options();

}  // namespace clarus::pipelines
