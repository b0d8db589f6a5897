#pragma once

#include <map>
#include <memory>
#include <optional>

#include "cl/context.h"
#include "graph/graph.h"
#include "runtime/jitter_sets.h"
#include "runtime/kernel_predictor.h"
#include "runtime/launch.h"

namespace clarus::runtime {

/// The packed weights of every convolution on the device, and of jitter-conditioned ones the set that the frame needs.
class Weights {
  public:
    /// `convolutions`: for each index into graph.parameters that is used, the kernel that it is packed for.
    Weights(ocl::Context& context, const Kernels& kernels, const graph::Graph& graph,
            const std::map<int, Lowered>& convolutions);

    /// Packs those of another graph of the same parameters that are not packed yet.
    void add(const Kernels& kernels, const graph::Graph& graph, const std::map<int, Lowered>& convolutions);

    /// Makes the sets for this jitter the current ones, computing them where they are not there.
    void select(Vec2 jitter);

    const cl::Buffer& packed(int parameters) const { return packed_.at(parameters).buffer; }
    /// Where the current set begins, in floats.
    cl_uint offset(int parameters) const;

    /// JitterSets::largest_distance.
    double largest_jitter_distance() const { return sets_ ? sets_->largest_distance() : 0; }

    /// Device memory that the constructor will take, in bytes.
    static size_t bytes(const graph::Graph& graph, const std::map<int, Lowered>& convolutions);

  private:
    struct Packed {
        size_t floats = 0;  // of a set
        bool conditioned = false;
        cl::Buffer buffer;
        std::unique_ptr<PackLaunch> pack;
    };

    void pack(const Kernels& kernels, const graph::Graph& graph, int index, const Packing& packing);
    void upload_packed(const graph::Parameters& parameters, const Packing& packing, const cl::Buffer& buffer);
    void compute(Vec2 jitter, int set);

    ocl::Context& context_;
    struct Predicted {
        int parameters;
        size_t weights, biases;  // floats of the predictor's output
    };

    std::map<int, Packed> packed_;
    std::vector<Predicted> predicted_;  // in the order of that output; some may be for convolutions of another device
    std::optional<JitterSets> sets_;
    std::unique_ptr<KernelPredictor> predictor_;
    int current_set_ = 0;
};

}  // namespace clarus::runtime
