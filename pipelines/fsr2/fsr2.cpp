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
    const Value history = graph.previous({4, settings.output.height, settings.output.width}, "history");

    const auto [checked, hr_motion] = checked_history(graph, motion, depth, settings.scale, settings.output);
    const Value past = graph.warp_sharply(history, hr_motion, color, settings.scale);
    const Value trust = graph.trust(graph.residual(color, past), checked, settings.scale);
    const Value collected = graph.collect(color, past, trust, hr_motion, settings.scale);
    graph.history_trust = trust;
    graph.carry(history, collected);
    graph.output = graph.slice(collected, 0, 3);
    const auto sharpness = static_cast<float>(settings.options.at("sharpness"));
    if (sharpness > 0) graph.output = graph.rcas(graph.output, sharpness);

    graph.views = {{"motion", hr_motion},
                   {"past", graph.slice(past, 0, 3)},
                   {"past_weight", graph.slice(past, 3, 1)},
                   {"trust", trust},
                   {"weight", graph.slice(collected, 3, 1)},
                   {"input_motion", motion},
                   {"input_depth", depth},
                   {"input_color", color},
                   {"output", graph.output}};
    return graph;
}

}  // namespace clarus::pipelines
