#include "pipelines/pipeline.h"

// pipelines.md, "Filters without a network". They know the jitter, so that what a network is compared with is not
// shifted by half a pixel.
namespace clarus::pipelines {
namespace {

graph::Graph build(graph::Filter filter, double scale, Size render, Size output) {
    graph::Graph graph;
    graph.output = graph.resample(graph.input(graph::Resource::color, render), filter, scale, output);
    return graph;
}

}  // namespace

graph::Graph build_nearest(double scale, Size render, Size output) {
    return build(graph::Filter::nearest, scale, render, output);
}

graph::Graph build_bilinear(double scale, Size render, Size output) {
    return build(graph::Filter::bilinear, scale, render, output);
}

graph::Graph build_bicubic(double scale, Size render, Size output) {
    return build(graph::Filter::bicubic, scale, render, output);
}

graph::Graph build_lanczos(double scale, Size render, Size output) {
    return build(graph::Filter::lanczos, scale, render, output);
}

}  // namespace clarus::pipelines
