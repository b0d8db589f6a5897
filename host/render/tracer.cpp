#include "render/tracer.h"

#include <embree3/rtcore.h>

#include <limits>

namespace clarus::render {
namespace {

using Imath::V2d;
using Imath::V3f;

constexpr float infinity = std::numeric_limits<float>::infinity();
constexpr float near_plane = 0.02f;  // metres

/// Ray `i` of a packet, from an origin in a direction.
void set_ray(RTCRay16& rays, int i, const V3f& origin, const V3f& direction, float from) {
    rays.org_x[i] = origin.x;
    rays.org_y[i] = origin.y;
    rays.org_z[i] = origin.z;
    rays.dir_x[i] = direction.x;
    rays.dir_y[i] = direction.y;
    rays.dir_z[i] = direction.z;
    rays.tnear[i] = from;
    rays.tfar[i] = infinity;
    rays.time[i] = 0;
    rays.mask[i] = ~0u;
    rays.flags[i] = 0;
}

bool missed(const RTCRayHit16& hits, int i) { return hits.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID; }

}  // namespace

struct Tracer::Packet {
    alignas(64) int valid[packet_size];  // −1: to be traced
    alignas(64) RTCRayHit16 hits;
    Ray rays[packet_size];
};

void Tracer::trace(std::span<const V2d> points, const TextureFilter& filter, std::span<Sample> samples) const {
    Packet packet;
    intersect(points, packet);
    const int count = static_cast<int>(points.size());

    const V3f eye(camera_.position()), to_sun = scene_.environment.to_sun;
    alignas(64) RTCRay16 shadow_rays;
    Surface surfaces[packet_size];
    bool any_surface = false;
    for (int i = 0; i < count; ++i) {
        Ray& ray = packet.rays[i];
        if (missed(packet.hits, i)) {
            samples[i] = {sky(scene_.environment, ray, filter), infinity, nullptr};
            packet.valid[i] = 0;
            continue;
        }
        any_surface = true;
        const RTCHit16& hits = packet.hits.hit;
        const Hit hit = {
            &scene_.part(hits.instID[0][i]),           hits.geomID[i], hits.primID[i], hits.u[i], hits.v[i],
            {hits.Ng_x[i], hits.Ng_y[i], hits.Ng_z[i]}};
        ray.view_distance = packet.hits.ray.tfar[i];
        samples[i] = {V3f(0), ray.view_distance, hit.part};
        surfaces[i] = surface_at(scene_, hit, ray, filter);
        // The shadow ray starts a little off the surface, on the side that the sun is on.
        const V3f& facet = surfaces[i].facet_normal;
        const float clearance = (1e-3f + 1e-4f * ray.view_distance) * ((facet ^ to_sun) < 0 ? -1.0f : 1.0f);
        set_ray(shadow_rays, i, eye + ray.direction * ray.view_distance + facet * clearance, to_sun, 0);
    }
    if (!any_surface) return;
    // Not marked as coherent: Embree 3.13 then does not return from some packets of shadow rays among instances.
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcOccluded16(packet.valid, scene_.embree(), &context, &shadow_rays);
    for (int i = 0; i < count; ++i) {
        if (!packet.valid[i]) continue;
        const bool sunlit = shadow_rays.tfar[i] >= 0;  // Embree sets it to −∞ where something is in the way
        samples[i].radiance = shade(scene_.environment, surfaces[i], packet.rays[i], sunlit);
    }
}

void Tracer::trace_geometry(std::span<const V2d> points, std::span<Sample> samples) const {
    Packet packet;
    intersect(points, packet);
    const int count = static_cast<int>(points.size());
    for (int i = 0; i < count; ++i) {
        const bool sky = missed(packet.hits, i);
        samples[i].view_distance = sky ? infinity : packet.hits.ray.tfar[i];
        samples[i].part = sky ? nullptr : &scene_.part(packet.hits.hit.instID[0][i]);
    }
}

void Tracer::intersect(std::span<const V2d> points, Packet& packet) const {
    const V3f eye(camera_.position());
    const int count = static_cast<int>(points.size());
    for (int i = 0; i < packet_size; ++i) {
        packet.valid[i] = i < count ? -1 : 0;
        if (i >= count) continue;
        packet.rays[i] = {.direction = V3f(camera_.direction(points[i])),
                          .pixel_width = static_cast<float>(camera_.pixel_width())};
        set_ray(packet.hits.ray, i, eye, packet.rays[i].direction, near_plane);
        packet.hits.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
        packet.hits.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
    }
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    rtcIntersect16(packet.valid, scene_.embree(), &context, &packet.hits);
}

}  // namespace clarus::render
