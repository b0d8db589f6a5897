#pragma once

#include <map>
#include <optional>
#include <string>

#include "clarus/model.h"
#include "clarus/types.h"
#include "graph/graph.h"

namespace clarus {

/// The longest side of an image: more is a mistake rather than an image.
inline constexpr int kLargestSide = 1 << 15;

/// Output resolution of a render resolution, sides rounded to the nearest. Errors: invalid_argument where either is not
/// from 1 to kLargestSide on a side.
Size output_size(Size render, double scale);

/// What is shown of a model's result of size `own`: the size asked for, or else that. Errors: invalid_argument where it
/// is not from 1 to kLargestSide on a side, or more than kMostFitRatio times as large or small as the result along an
/// axis.
Size shown_size(Size own, const std::optional<Size>& asked);

/// Output over render resolution, where that is one scale along both axes but for what rounding a render size changes.
std::optional<double> common_scale(Size render, Size output);

/// At what scale a model is run, and what size it makes.
struct ModelSizes {
    double scale;
    Size own;
};
/// At its own scale; where an output size is asked for, a model of any scale at the ratio of the sizes, if that is the
/// same along both axes, or at the one of its scales that is nearest to it. Errors: invalid_argument, as output_size().
ModelSizes model_sizes(const Model& model, Size render, const std::optional<Size>& asked);

/// What the model computes at this size, at its own scale or another that it has. Errors: invalid_argument, naming the
/// model and the pipeline's option that it does not have or that is out of range.
graph::Graph build_graph(const Model& model, Size render, Size output,
                         const std::map<std::string, double>& pipeline_options = {}, std::optional<double> scale = {});

}  // namespace clarus
