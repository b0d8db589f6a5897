#include "pipelines/pipeline.h"
#include "pipelines/sharpness.h"

// docs/pipelines.md, "Filters without a network". They know the jitter, so that what a network is compared with is not
// shifted by half a pixel.
namespace clarus::pipelines {
namespace {

using graph::Graph;
using graph::Resource;
using graph::Value;

Graph resampled(graph::Filter filter, const FilterSettings& settings) {
    Graph graph;
    const Value color = graph.input(Resource::color, settings.render);
    graph.output = graph.resample(color, filter, settings.scale, settings.output);
    graph.views = {{"input_color", color}, {"output", graph.output}};
    return graph;
}

}  // namespace

Graph build_nearest(const FilterSettings& settings) { return resampled(graph::Filter::nearest, settings); }
Graph build_bilinear(const FilterSettings& settings) { return resampled(graph::Filter::bilinear, settings); }
Graph build_bicubic(const FilterSettings& settings) { return resampled(graph::Filter::bicubic, settings); }
Graph build_lanczos(const FilterSettings& settings) { return resampled(graph::Filter::lanczos, settings); }

// 2^-0.2: AMD's own is 0.2 stops below the most.
std::vector<PipelineOption> fsr1_options() { return {sharpness_option(0.87)}; }

Graph build_fsr1(const FilterSettings& settings) {
    Graph graph;
    const Value color = graph.input(Resource::color, settings.render);
    const Value upsampled = graph.easu(color, settings.scale, settings.output);
    graph.output = graph.rcas(upsampled, static_cast<float>(settings.options.at("sharpness")));
    graph.views = {{"input_color", color}, {"upsampled", upsampled}, {"output", graph.output}};
    return graph;
}

}  // namespace clarus::pipelines
