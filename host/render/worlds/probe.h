#pragma once

#include <Imath/ImathVec.h>

#include <optional>

#include "render/camera.h"
#include "render/scene.h"

namespace clarus::render {

/// To what a ray from a point meets, in units of `direction`; nothing within `farthest`: none.
std::optional<double> distance_along(const Scene& scene, const Imath::V3d& from, const Imath::V3d& direction,
                                     double farthest);

/// The height of what is below a point.
std::optional<double> ground_below(const Scene& scene, const Imath::V3d& from);

/// To the nearest thing in any of many directions, at most `farthest`.
double clearance(const Scene& scene, const Imath::V3d& from, double farthest);

/// What a camera has before it: shares of its picture.
struct View {
    double close = 0;  // nearer than a metre
    double empty = 0;  // sky
    int things = 0;    // different meshes
};
View look(const Scene& scene, const CameraPose& pose);

}  // namespace clarus::render
