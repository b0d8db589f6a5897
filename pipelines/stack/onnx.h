#pragma once

#include "io/onnx.h"
#include "io/safetensors.h"

namespace clarus::pipelines {

/// A network of one frame in ONNX form as the model file of a stack of layers, which is then read as any other is. Its
/// input is an image [1, channels, height, width] of display values in [0, 1], of 3 channels (red, green, blue) or 1
/// (luma), its output one of as many channels, from 1 to 8 times as large. Operators: docs/formats.md, "ONNX networks".
/// Errors: file, naming the file, the first node that cannot be taken, its operator, and what is taken.
io::Safetensors stack_of(const io::OnnxGraph& network);

}  // namespace clarus::pipelines
