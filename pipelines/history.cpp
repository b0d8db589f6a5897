#include "pipelines/history.h"

#include <string>
#include <string_view>

#include "base/error.h"

namespace clarus::pipelines {
namespace {

/// Whether the metadata says `other`, rather than nothing or `usual`.
bool asks_for(const io::Safetensors& model, const std::string& key, std::string_view usual, std::string_view other) {
    const auto found = model.metadata().find(key);
    if (found == model.metadata().end() || found->second == usual) return false;
    if (found->second != other)
        fail(ErrorKind::file, R"({}: metadata `{}` is "{}"; known: {}, {})", model.path().string(), key, found->second,
             usual, other);
    return true;
}

}  // namespace

HistoryOptions history_options(const io::Safetensors& model) {
    return {asks_for(model, "history", "plain", "checked"), asks_for(model, "range", "unit", "held")};
}

CheckedHistory checked_history(graph::Graph& graph, graph::Value motion, graph::Value depth, double scale,
                               Size output) {
    const graph::Value before = graph.depth_before(motion, depth);
    const graph::Value checked = graph.checked_motion(motion, before, graph.previous_depth(motion, before));
    return {checked, graph.reproject(checked, depth, scale, output)};
}

CollectedHistory collected_history(graph::Graph& graph, graph::Value color, graph::Value depth, graph::Value motion,
                                   double scale, Size output) {
    const graph::Value history = graph.previous({4, output.height, output.width}, "history");
    const auto [checked, hr_motion] = checked_history(graph, motion, depth, scale, output);
    const graph::Value past = graph.warp_sharply(history, hr_motion, color, scale);
    const graph::Value trust = graph.trust(graph.residual(color, past), checked, scale);
    const graph::Value collected = graph.collect(color, past, trust, hr_motion, scale);
    graph.history_trust = trust;
    graph.carry(history, collected);
    graph.views.insert({{"motion", hr_motion},
                        {"past", graph.slice(past, 0, 3)},
                        {"past_weight", graph.slice(past, 3, 1)},
                        {"trust", trust},
                        {"weight", graph.slice(collected, 3, 1)}});
    return {trust, collected};
}

}  // namespace clarus::pipelines
