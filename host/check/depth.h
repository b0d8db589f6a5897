#pragma once

#include <array>
#include <vector>

#include "check/warping.h"

namespace clarus::check {

/// What depth can hold, as planes see it: along a straight line on a plane, the inverse of view distance is linear.
enum class DepthForm { linear, linear_reversed, projective };

/// A figure a frame, or a pair of frames, for each of some answers: the smaller, the better that answer fits. NaN where
/// there is none.
template <size_t N>
using Answers = std::array<std::vector<float>, N>;

/// Of depth as stored; of motion by the reading that fits.
struct DepthEvidence {
    /// A pair each: pixels whose surface was hidden in the frame before, by something whose stored depth was larger,
    /// or smaller. What hides is nearer. [0]: by larger ones, [1]: by smaller ones.
    Answers<2> hidden_by;
    /// A frame each, by DepthForm: second differences of inverse view distance over its first differences, the median
    /// over smooth surfaces.
    Answers<3> curvature;
    /// A pair each, where both frames have a camera: the median distance, in pixels, of stored motion from what the
    /// cameras make of depth. 0: linear, 1: linear reversed; with the JSON's planes, where it has any, 2: projective,
    /// 3: projective reversed; with the camera's planes, 4 and 5: likewise.
    Answers<6> reprojected;
};

/// `depth_frame`: depth images are those of so many frames later.
DepthEvidence measure_depth(const Film& film, const std::vector<Pair>& pairs, const Reading& reading, int depth_frame);

/// A frame each: how little the edges of depth lie on those of colour, where the depth image is that of the frame
/// itself [0], of the one before [1], of the next [2].
Answers<3> measure_depth_edges(const Film& film);

}  // namespace clarus::check
