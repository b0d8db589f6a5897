#pragma once

#include <span>

#include "render/camera.h"
#include "render/scene.h"
#include "render/shade.h"

namespace clarus::render {

/// What a ray saw.
struct Sample {
    Imath::V3f radiance;
    // Of what is opaque, behind all that is blended:
    double view_distance;     // infinite for the sky
    const Scene::Part* part;  // null for the sky
    Imath::V3d before;        // where it was at the previous time; of trace_geometry, not of the sky
};

/// Looks at a scene through a camera, a packet of rays at a time. Both must outlive it. Thread-safe.
class Tracer {
  public:
    static constexpr int packet_size = 16;

    /// Nothing is seen that is nearer than `near_plane`.
    Tracer(const Scene& scene, const Camera& camera, float near_plane)
        : scene_(scene), camera_(camera), near_plane_(near_plane) {}

    /// Traces and shades rays through at most packet_size points of the image, in render pixels. Each has its place in
    /// `samples`.
    void trace(std::span<const Imath::V2d> points, const TextureFilter& filter, std::span<Sample> samples) const;
    /// The same without light, `radiance` is left as it was, and with exact distances and places before.
    void trace_geometry(std::span<const Imath::V2d> points, std::span<Sample> samples) const;

  private:
    struct Packet;
    Packet packet(std::span<const Imath::V2d> points) const;
    void intersect_solid(Packet& packet, std::span<Sample> samples) const;
    void shade_hits(Packet& packet, const TextureFilter& filter, std::span<Shaded> shaded) const;
    void add_blended(Packet& packet, const TextureFilter& filter, std::span<Sample> samples) const;

    const Scene& scene_;
    const Camera& camera_;
    const float near_plane_;
};

}  // namespace clarus::render
