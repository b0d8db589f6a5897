#pragma once

#include <string>
#include <vector>

#include "runtime/implementation.h"

namespace clarus::runtime {

/// One of the images that a convolution's input is made of.
struct InputPart {
    graph::Reading reading;
    int image;  // which of the problem's inputs
    int first;  // of the input's channels
    int channels;
    int lane;         // where it begins if every part takes whole vectors: convolution_winograd.cl
    int factor = -1;  // which of the problem's inputs, where it is weighted
};

/// What a convolution reads, as kernels/convolution_input.clh has it.
struct ConvolutionInput {
    explicit ConvolutionInput(const Problem& problem);

    /// Adds to the call what is compiled and the tensors.
    void describe(KernelCall& call) const;
    /// The first that the kernels take.
    std::vector<Argument> arguments() const;

    std::vector<InputPart> parts;
    int channels = 0, lanes = 0;  // of all parts

  private:
    const Problem& problem_;
};

}  // namespace clarus::runtime
