#include "render/worlds/probe.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <utility>

namespace clarus::render {

using Imath::V2d;
using Imath::V3d;

namespace {

RTCRayHit shoot(const Scene& scene, const V3d& from, const V3d& direction, double farthest) {
    RTCRayHit query{};
    query.ray.org_x = static_cast<float>(from.x);
    query.ray.org_y = static_cast<float>(from.y);
    query.ray.org_z = static_cast<float>(from.z);
    query.ray.dir_x = static_cast<float>(direction.x);
    query.ray.dir_y = static_cast<float>(direction.y);
    query.ray.dir_z = static_cast<float>(direction.z);
    query.ray.tfar = static_cast<float>(farthest);
    query.ray.mask = std::numeric_limits<unsigned>::max();
    query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcIntersect1(scene.embree(), &context, &query);
    return query;
}

}  // namespace

std::optional<double> distance_along(const Scene& scene, const V3d& from, const V3d& direction, double farthest) {
    const RTCRayHit found = shoot(scene, from, direction, farthest);
    if (found.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
    return found.ray.tfar;
}

std::optional<double> ground_below(const Scene& scene, const V3d& from) {
    const auto depth = distance_along(scene, from, {0, -1, 0}, std::numeric_limits<float>::max());
    return depth ? std::optional(from.y - *depth) : std::nullopt;
}

double clearance(const Scene& scene, const V3d& from, double farthest) {
    // A spiral from pole to pole.
    constexpr int directions = 48;
    double nearest = farthest;
    for (int i = 0; i < directions; ++i) {
        const double y = 1 - (2 * i + 1.0) / directions, ring = std::sqrt(1 - y * y), turn = i * 2.4;
        const V3d direction(ring * std::cos(turn), y, ring * std::sin(turn));
        nearest = std::min(nearest, distance_along(scene, from, direction, nearest).value_or(nearest));
    }
    return nearest;
}

View look(const Scene& scene, const CameraPose& pose) {
    constexpr Size grid{12, 8};
    constexpr double share = 1.0 / (grid.width * grid.height);
    const Camera camera(pose, grid);
    View view;
    std::set<std::pair<unsigned, unsigned>> things;
    for (int y = 0; y < grid.height; ++y) {
        for (int x = 0; x < grid.width; ++x) {
            const RTCRayHit found = shoot(scene, camera.position(), camera.direction(V2d(x + 0.5, y + 0.5)), 10000);
            const bool hit = found.hit.geomID != RTC_INVALID_GEOMETRY_ID;
            if (!hit) view.empty += share;
            if (hit && found.ray.tfar < 1) view.close += share;
            if (hit) things.emplace(found.hit.instID[0], found.hit.geomID);
        }
    }
    view.things = static_cast<int>(things.size());
    return view;
}

}  // namespace clarus::render
