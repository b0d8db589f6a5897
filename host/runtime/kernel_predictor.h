#pragma once

#include <vector>

#include "cl/context.h"
#include "graph/graph.h"

namespace clarus::runtime {

/// The perceptron that predicts jitter-conditioned kernels (docs/pipelines.md, "Jitter-conditioned kernels"), its dense
/// layers on CLBlast.
class KernelPredictor {
  public:
    KernelPredictor(ocl::Context& context, const std::vector<graph::DenseLayer>& layers);

    /// Enqueues the evaluation for one jitter. The result is valid for commands enqueued before the next call.
    const cl::Buffer& predict(Vec2 jitter);

    /// Device memory, in bytes.
    static size_t bytes(const std::vector<graph::DenseLayer>& layers);

  private:
    struct Layer {
        size_t out = 0, in = 0;
        cl::Buffer weights, biases, result;
    };

    ocl::Context& context_;
    cl::Buffer jitter_;
    std::vector<Layer> layers_;
    cl::Kernel rectify_;
};

}  // namespace clarus::runtime
