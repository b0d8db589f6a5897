#pragma once

#include <numeric>
#include <tuple>
#include <utility>
#include <vector>

#include "graph/graph.h"

namespace clarus::pipelines {

/// What flows from layer to layer of a stack: an image, of which consecutive channels may be values of their own, and
/// how many times as large as the network's input it is, `grown` / `shrunk`. Copies are of the same image. Refers to
/// the graph.
class Flow {
  public:
    Flow(graph::Graph& graph, graph::Value image) : graph_(&graph), parts_{image} {}

    int channels() const {
        return std::accumulate(parts_.begin(), parts_.end(), 0,
                               [&](int sum, graph::Value part) { return sum + graph_->shape(part).channels; });
    }
    /// Whether both are of one size where strides divide the network's input.
    bool is_as_large_as(const Flow& other) const { return grown * other.shrunk == other.grown * shrunk; }

    graph::Value whole() {
        if (parts_.size() > 1) parts_ = {graph_->concat(parts_)};
        return parts_.front();
    }
    graph::Value channels(int first, int count) {
        int begin = 0;
        for (const graph::Value part : parts_) {
            const int end = begin + graph_->shape(part).channels;
            if (first >= begin && first + count <= end)
                return count == end - begin ? part : graph_->slice(part, first - begin, count);
            begin = end;
        }
        return graph_->slice(whole(), first, count);
    }
    void replace(graph::Value image) { parts_ = {image}; }
    void replace(int first, int count, graph::Value image) {
        const int rest = channels() - first - count;
        std::vector<graph::Value> parts;
        if (first > 0) parts.push_back(channels(0, first));
        parts.push_back(image);
        if (rest > 0) parts.push_back(channels(first + count, rest));
        parts_ = std::move(parts);
    }
    /// Behind the channels that there are.
    void append(const Flow& other) {
        parts_.insert(parts_.end(), other.parts_.begin(), other.parts_.end());
        take_size(other);
    }
    /// Of one as large, put together with this one: the strides of both must divide the network's input.
    void take_size(const Flow& other) {
        if (other.shrunk > shrunk) std::tie(grown, shrunk) = std::pair(other.grown, other.shrunk);
    }

    int grown = 1, shrunk = 1;  // by the layers so far

  private:
    graph::Graph* graph_;
    std::vector<graph::Value> parts_;
};

}  // namespace clarus::pipelines
