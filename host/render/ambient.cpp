#include "render/ambient.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace clarus::render {
namespace {

using Imath::V3f;

constexpr int packet = 16;
constexpr size_t most_rays = 4'000'000;  // a few seconds' work for one core
constexpr int most_packets = 2;          // a vertex
constexpr float reach = 4;               // metres; what is farther takes nothing away
constexpr float darkest = 0.25f;         // light that was reflected more often comes into every corner

/// Unit vectors around +z, as many in any solid angle as its share of a matt surface's light.
std::vector<V3f> cosine_directions(int count) {
    std::vector<V3f> directions;
    for (int i = 0; i < count; ++i) {
        const float square = (static_cast<float>(i) + 0.5f) / static_cast<float>(count), radius = std::sqrt(square);
        const float angle = 2 * std::numbers::pi_v<float> * static_cast<float>(i) / std::numbers::phi_v<float>;
        directions.push_back({radius * std::cos(angle), radius * std::sin(angle), std::sqrt(1 - square)});
    }
    return directions;
}

/// For each vertex, the mean of the ways to the centres of its triangles.
std::vector<V3f> ways_inwards(const Mesh& mesh) {
    std::vector<V3f> ways(mesh.positions.size(), V3f(0));
    std::vector<float> counts(ways.size(), 0);
    for (const auto& triangle : mesh.triangles) {
        V3f centre(0);
        for (const uint32_t corner : triangle) centre += mesh.positions[corner] / 3;
        for (const uint32_t corner : triangle) {
            ways[corner] += centre - mesh.positions[corner];
            ++counts[corner];
        }
    }
    for (size_t i = 0; i < ways.size(); ++i) ways[i] /= std::max(counts[i], 1.0f);
    return ways;
}

float openness(RTCScene solid, const V3f& point, const V3f& normal, const std::vector<V3f>& directions) {
    const V3f side = (std::abs(normal.y) < 0.9f ? V3f(0, 1, 0) % normal : V3f(1, 0, 0) % normal).normalized();
    const V3f other = normal % side;
    float taken = 0;
    for (size_t first = 0; first < directions.size(); first += packet) {
        alignas(64) int valid[packet];
        alignas(64) RTCRayHit16 rays;
        for (int i = 0; i < packet; ++i) {
            const V3f& local = directions[first + static_cast<size_t>(i)];
            const V3f direction = side * local.x + other * local.y + normal * local.z;
            valid[i] = -1;
            rays.ray.org_x[i] = point.x, rays.ray.org_y[i] = point.y, rays.ray.org_z[i] = point.z;
            rays.ray.dir_x[i] = direction.x, rays.ray.dir_y[i] = direction.y, rays.ray.dir_z[i] = direction.z;
            rays.ray.tnear[i] = 0, rays.ray.tfar[i] = reach, rays.ray.time[i] = 0;
            rays.ray.mask[i] = ~0u, rays.ray.flags[i] = 0;
            rays.hit.geomID[i] = rays.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
        }
        RTCIntersectContext context;
        rtcInitIntersectContext(&context);
        rtcIntersect16(valid, solid, &context, &rays);
        for (int i = 0; i < packet; ++i) {
            taken += 1 - rays.ray.tfar[i] / reach;  // 0 where nothing was hit
        }
    }
    return 1 - (1 - darkest) * taken / static_cast<float>(directions.size());
}

float vertex_openness(RTCScene solid, const V3f& position, const V3f& normal, const V3f& inwards,
                      const std::vector<V3f>& directions) {
    // Not from the vertex itself: where two surfaces meet, it is chance on which side of the other one it is. And not
    // from a place that is shut in, in the ground or in a post, nor from the wrong side of a sheet.
    constexpr float clearance = 2e-3f, small_step = 0.03f;  // metres
    constexpr float shut_in = 0.3f;
    const float near = std::min(0.1f, small_step / std::max(inwards.length(), 1e-6f)), far = 0.4f;
    float best = 0;
    for (const float step : {near, far}) {
        for (const V3f& side : {normal, -normal}) {
            const V3f place = position + inwards * step + side * clearance;
            if (best < shut_in) best = std::max(best, openness(solid, place, side, directions));
        }
    }
    return best;
}

}  // namespace

std::vector<std::vector<float>> bake_openness(RTCScene solid, const Model& model, size_t all_vertices) {
    const size_t affordable = most_rays / packet / std::max<size_t>(all_vertices, 1);
    const std::vector<V3f> directions =
        cosine_directions(packet * static_cast<int>(std::clamp<size_t>(affordable, 1, most_packets)));
    std::vector<std::vector<float>> baked;
    for (const Mesh& mesh : model) {
        auto& values = baked.emplace_back(mesh.positions.size(), 1.0f);
        const std::vector<V3f> inwards = ways_inwards(mesh);
        tbb::parallel_for(size_t{0}, values.size(), [&](size_t i) {
            const V3f normal = mesh.normals[i].normalized();
            if (normal.length2() > 0)
                values[i] = vertex_openness(solid, mesh.positions[i], normal, inwards[i], directions);
        });
    }
    return baked;
}

}  // namespace clarus::render
