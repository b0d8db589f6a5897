#pragma once

#include "render/scene.h"

namespace clarus::render {

/// How the texture under a sample is filtered.
struct TextureFilter {
    float sample_width = 1;  // distance of samples in render pixels: what a texel should cover
    float level_bias = 0;    // added to the mip level
    int max_anisotropy = 4;  // lookups along a footprint's long side
};

/// A ray through one point of the image and what it met, in world space. View axis: see Camera::direction.
struct Ray {
    Imath::V3f direction;              // its component along the view axis is 1
    Imath::V3f step_right, step_down;  // to the next samples' directions
    float view_distance = 0;           // to the hit
};

struct Hit {
    const Scene::Part* part;
    unsigned mesh, triangle;
    float u, v;               // barycentric
    Imath::V3f facet_normal;  // object space, any length
};

/// A point of a surface, ready for light.
struct Surface {
    const Material* material;
    Imath::V3f normal, facet_normal;  // unit, towards the viewer
    Imath::V3f albedo;
    float alpha;     // 1 where the material is not blended
    float openness;  // share of the sky's light that comes here past what is near
};

/// The texture is filtered over the ray's footprint: its differentials on the surface.
Surface surface_at(const Scene& scene, const Hit& hit, const Ray& ray, const TextureFilter& filter);

/// What leaves a surface towards the viewer: linear radiance, and the share of what is behind that shines through.
struct Shaded {
    Imath::V3f radiance;
    float transmittance;
};
Shaded shade(const Environment& environment, const Surface& surface, const Ray& ray, bool sunlit);

/// Linear radiance of the sky in a direction of any length.
Imath::V3f sky(const Environment& environment, const Ray& ray, const TextureFilter& filter);

}  // namespace clarus::render
