#pragma once

#include <optional>
#include <vector>

#include "pipelines/stack/onnx_node.h"

namespace clarus::pipelines {

/// What a node makes of values that are known before the network runs: constants, and the arithmetic on sizes that
/// exporters write out. `inputs` are the node's, null where one is left out. None where it is another operator. Errors:
/// file, for what is no such arithmetic.
std::optional<io::OnnxTensor> computed(const OnnxNodeReader& node, const std::vector<const io::OnnxTensor*>& inputs);

/// Sizes or places in a list.
io::OnnxTensor list_of(std::vector<int64_t> numbers);

/// The part of a range of so many that ONNX's Slice means by two numbers, as begin and end. Negative ones count from
/// its end.
std::pair<int64_t, int64_t> sliced_range(int64_t extent, int64_t start, int64_t end);

}  // namespace clarus::pipelines
