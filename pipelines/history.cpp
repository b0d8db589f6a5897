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
    const graph::Value checked = graph.checked_motion(motion, depth, graph.previous_depth(motion, depth));
    return {checked, graph.reproject(checked, depth, scale, output)};
}

}  // namespace clarus::pipelines
