#include "pipelines/history.h"
#include "pipelines/pipeline.h"
#include "pipelines/sharpness.h"

// docs/fsr2.md.
namespace clarus::pipelines {

using graph::Graph;
using graph::Resource;
using graph::Value;

// FSR 2 leaves sharpening to be asked for.
std::vector<PipelineOption> fsr2_options() { return {sharpness_option(0)}; }

graph::Graph build_fsr2(const FilterSettings& settings) {
    Graph graph;
    const Value color = graph.input(Resource::color, settings.render);
    const Value depth = graph.input(Resource::depth, settings.render);
    const Value motion = graph.input(Resource::motion, settings.render);

    const Value collected = collected_history(graph, color, depth, motion, settings.scale, settings.output).collected;
    graph.output = graph.slice(collected, 0, 3);
    const auto sharpness = static_cast<float>(settings.options.at("sharpness"));
    if (sharpness > 0) graph.output = graph.rcas(graph.output, sharpness);

    graph.views.insert(
        {{"input_motion", motion}, {"input_depth", depth}, {"input_color", color}, {"output", graph.output}});
    return graph;
}

}  // namespace clarus::pipelines
