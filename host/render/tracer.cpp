#include "render/tracer.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace clarus::render {
namespace {

using Imath::V2d;
using Imath::V3d;
using Imath::V3f;

constexpr float infinity = std::numeric_limits<float>::infinity();
constexpr int most_layers = 4;  // of blended surfaces, from the front

void set_ray(RTCRay16& rays, int i, const V3f& origin, const V3f& direction, float from, float to) {
    rays.org_x[i] = origin.x;
    rays.org_y[i] = origin.y;
    rays.org_z[i] = origin.z;
    rays.dir_x[i] = direction.x;
    rays.dir_y[i] = direction.y;
    rays.dir_z[i] = direction.z;
    rays.tnear[i] = from;
    rays.tfar[i] = to;
    rays.time[i] = 0;
    rays.mask[i] = ~0u;
    rays.flags[i] = 0;
}

/// In double precision: far from the world's origin Embree's single precision misses by millimetres, which motion
/// vectors of what turns fast would show.
double refined_distance(double distance, const Scene::Part& part, const Mesh& mesh, unsigned triangle, const V3d& eye,
                        const V3d& direction) {
    const auto [a, b, c] = mesh.triangles[triangle];
    const V3d corner(mesh.positions[a]);
    const V3d normal = (V3d(mesh.positions[b]) - corner) % (V3d(mesh.positions[c]) - corner);
    V3d object_direction;
    part.to_object.multDirMatrix(direction, object_direction);
    const double refined = ((corner - eye * part.to_object) ^ normal) / (object_direction ^ normal);
    // Otherwise the ray passes the triangle, nearly seen edge on, by less than rounding.
    return std::abs(refined - distance) < 1e-3 * distance ? refined : distance;
}

/// Where a point that is seen on a triangle was at the previous time.
V3d place_before(const Scene::Part& part, const Mesh& mesh, unsigned triangle, const V3d& point) {
    if (!part.deformation) return point * part.to_previous;
    const auto [a, b, c] = mesh.triangles[triangle];
    const V3d corner(mesh.positions[a]), e1 = V3d(mesh.positions[b]) - corner, e2 = V3d(mesh.positions[c]) - corner;
    const V3d normal = e1 % e2, offset = point - corner;
    const double u = ((offset % e2) ^ normal) / (normal ^ normal), v = ((e1 % offset) ^ normal) / (normal ^ normal);
    const std::vector<V3f>& before = part.previous_positions;
    return V3d(before[a]) * (1 - u - v) + V3d(before[b]) * u + V3d(before[c]) * v;
}

bool missed(const RTCHit16& hits, int i) { return hits.geomID[i] == RTC_INVALID_GEOMETRY_ID; }

}  // namespace

struct Tracer::Packet {
    int count;                           // of rays
    alignas(64) int valid[packet_size];  // −1: to be traced, or to be shaded
    alignas(64) RTCRayHit16 hits{};      // all lanes: with AVX2 Embree 3.13 asserts on what is left in the others
    Ray rays[packet_size];

    void intersect(RTCScene scene, const V3f& eye, const std::array<float, packet_size>& from,
                   const std::array<float, packet_size>& to, RTCIntersectContextFlags flags) {
        for (int i = 0; i < count; ++i) {
            set_ray(hits.ray, i, eye, rays[i].direction, from[i], to[i]);
            hits.hit.geomID[i] = hits.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
        }
        RTCIntersectContext context;
        rtcInitIntersectContext(&context);
        context.flags = flags;
        rtcIntersect16(valid, scene, &context, &hits);
        for (int i = 0; i < count; ++i) {
            if (valid[i] && missed(hits.hit, i)) valid[i] = 0;
            if (valid[i]) rays[i].view_distance = hits.ray.tfar[i];
        }
    }
};

void Tracer::trace(std::span<const V2d> points, const TextureFilter& filter, std::span<Sample> samples) const {
    Packet rays = packet(points);
    for (Ray& ray : rays.rays) {
        ray.step_right *= filter.sample_width;
        ray.step_down *= filter.sample_width;
    }
    intersect_solid(rays, samples);
    std::array<Shaded, packet_size> shaded;
    shade_hits(rays, filter, shaded);
    for (int i = 0; i < rays.count; ++i) {
        samples[i].radiance = rays.valid[i] ? shaded[i].radiance : sky(scene_.environment, rays.rays[i], filter);
    }
    if (scene_.embree_blended()) add_blended(rays, filter, samples);
}

void Tracer::trace_geometry(std::span<const V2d> points, std::span<Sample> samples) const {
    Packet rays = packet(points);
    intersect_solid(rays, samples);
    const RTCHit16& hits = rays.hits.hit;
    for (int i = 0; i < rays.count; ++i) {
        if (!rays.valid[i]) continue;
        const Scene::Part& part = *samples[i].part;
        const Mesh& mesh = part.model[hits.geomID[i]];
        const V3d &eye = camera_.position(), direction = camera_.direction(points[i]);
        Sample& sample = samples[i];
        sample.view_distance = refined_distance(sample.view_distance, part, mesh, hits.primID[i], eye, direction);
        sample.before = place_before(part, mesh, hits.primID[i], eye + direction * sample.view_distance);
    }
}

Tracer::Packet Tracer::packet(std::span<const V2d> points) const {
    const V3f right(camera_.step_right()), down(camera_.step_down());
    Packet packet;
    packet.count = static_cast<int>(points.size());
    for (int i = 0; i < packet_size; ++i) {
        packet.valid[i] = i < packet.count ? -1 : 0;
        packet.rays[i] = {V3f(camera_.direction(points[std::min(i, packet.count - 1)])), right, down};
    }
    return packet;
}

void Tracer::intersect_solid(Packet& packet, std::span<Sample> samples) const {
    std::array<float, packet_size> from, to;
    from.fill(near_plane_);
    to.fill(infinity);
    packet.intersect(scene_.embree(), V3f(camera_.position()), from, to, RTC_INTERSECT_CONTEXT_FLAG_COHERENT);
    for (int i = 0; i < packet.count; ++i) {
        const bool hit = packet.valid[i];
        samples[i].view_distance = hit ? packet.rays[i].view_distance : infinity;
        samples[i].part = hit ? &scene_.part(packet.hits.hit.instID[0][i]) : nullptr;
    }
}

/// Of the rays that are valid.
void Tracer::shade_hits(Packet& packet, const TextureFilter& filter, std::span<Shaded> shaded) const {
    const V3f eye(camera_.position()), to_sun = scene_.environment.to_sun;
    alignas(64) RTCRay16 shadow_rays{};  // all lanes, likewise
    std::array<Surface, packet_size> surfaces;
    bool any = false;
    for (int i = 0; i < packet.count; ++i) {
        if (!packet.valid[i]) continue;
        any = true;
        const RTCHit16& hits = packet.hits.hit;
        const Ray& ray = packet.rays[i];
        const Hit hit = {
            &scene_.part(hits.instID[0][i]),           hits.geomID[i], hits.primID[i], hits.u[i], hits.v[i],
            {hits.Ng_x[i], hits.Ng_y[i], hits.Ng_z[i]}};
        surfaces[i] = surface_at(scene_, hit, ray, filter);
        // The shadow ray starts a little off the surface, on the side that the sun is on.
        const V3f& facet = surfaces[i].facet_normal;
        const float clearance = (1e-3f + 1e-4f * ray.view_distance) * ((facet ^ to_sun) < 0 ? -1.0f : 1.0f);
        set_ray(shadow_rays, i, eye + ray.direction * ray.view_distance + facet * clearance, to_sun, 0, infinity);
    }
    if (!any) return;
    // Not marked as coherent (nor are blended layers): Embree 3.13 then does not return from some packets of shadow
    // rays among instances.
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcOccluded16(packet.valid, scene_.embree(), &context, &shadow_rays);
    for (int i = 0; i < packet.count; ++i) {
        if (!packet.valid[i]) continue;
        const bool sunlit = shadow_rays.tfar[i] >= 0;  // Embree sets it to −∞ where something is in the way
        shaded[i] = shade(scene_.environment, surfaces[i], packet.rays[i], sunlit);
    }
}

/// Layer by layer from the front, until little of what is opaque shines through.
void Tracer::add_blended(Packet& packet, const TextureFilter& filter, std::span<Sample> samples) const {
    std::array<float, packet_size> from, to, transmittance;
    std::array<V3f, packet_size> front;
    from.fill(near_plane_);
    transmittance.fill(1);
    front.fill(V3f(0));
    for (int i = 0; i < packet.count; ++i) {
        packet.valid[i] = -1;
        to[i] = static_cast<float>(samples[i].view_distance);
    }
    for (int layer = 0; layer < most_layers; ++layer) {
        packet.intersect(scene_.embree_blended(), V3f(camera_.position()), from, to,
                         RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT);
        std::array<Shaded, packet_size> shaded;
        shade_hits(packet, filter, shaded);
        bool any = false;
        for (int i = 0; i < packet.count; ++i) {
            if (!packet.valid[i]) continue;
            front[i] += shaded[i].radiance * transmittance[i];
            transmittance[i] *= shaded[i].transmittance;
            from[i] = packet.rays[i].view_distance * (1 + 1e-5f) + 1e-4f;
            packet.valid[i] = transmittance[i] > 1 / 256.0f ? -1 : 0;
            any |= packet.valid[i] != 0;
        }
        if (!any) break;
    }
    for (int i = 0; i < packet.count; ++i) samples[i].radiance = front[i] + samples[i].radiance * transmittance[i];
}

}  // namespace clarus::render
