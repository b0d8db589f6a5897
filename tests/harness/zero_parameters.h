#pragma once

#include "graph/graph.h"

/// Of a convolution in tests that look at shapes and memory only.
inline clarus::graph::Parameters zero_parameters(int out, int in) {
    clarus::graph::Parameters result{out, in};
    result.weights.assign(result.weights_per_set(), 0);
    result.biases.assign(out, 0);
    return result;
}
