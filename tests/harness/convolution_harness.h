#pragma once

#include <functional>
#include <random>

#include "operator_harness.h"

namespace clarus::test {

/// Parameters with which results of inputs in [-1, 1] are of the order of 1.
graph::Parameters random_parameters(int out_channels, int in_channels, int kernel, int sets, std::mt19937& random,
                                    int groups = 1, int stride = 1);

/// conv(a→b) of docs/pipelines.md, with groups and a stride, and relu where asked for, for `size` pixels of the image.
Planes expected_convolution(const Planes& image, const graph::Parameters& parameters, int set,
                            graph::Activation activation, Size size);

/// What a kernel may be off, in float.
float convolution_tolerance(const runtime::Implementation& implementation, const runtime::Choices& choices);

/// Calls visit(implementation, its choices, or the first of them) for what the device can be asked to run, and for the
/// kernel that is meant for GPUs on any; for the one in bfloat16 only where the problem allows it and the device has
/// it.
using VisitImplementation = std::function<void(const runtime::Implementation&, const runtime::Choices&)>;
void visit_implementations(const runtime::Problem& problem, bool all_choices, const VisitImplementation& visit);

}  // namespace clarus::test
