#pragma once

#include "render/scene.h"

namespace clarus::render {

/// How the texture under a sample is filtered.
struct TextureFilter {
    float sample_width = 1;  // distance of samples in render pixels: what a texel should cover
    float level_bias = 0;    // added to the mip level
    int max_anisotropy = 4;  // lookups along a footprint's long side
};

/// A ray through one point of the image and what it met. Vectors are in world space unless they say otherwise.
struct Ray {
    Imath::V3f direction;     // its component along the view axis is 1
    float view_distance = 0;  // to the hit
    float pixel_width = 0;    // of a render pixel, at a view distance of 1
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
};

Surface surface_at(const Scene& scene, const Hit& hit, const Ray& ray, const TextureFilter& filter);

/// Linear radiance that leaves the surface towards the viewer.
Imath::V3f shade(const Environment& environment, const Surface& surface, const Ray& ray, bool sunlit);

/// Linear radiance of the sky in a direction of any length.
Imath::V3f sky(const Environment& environment, const Ray& ray, const TextureFilter& filter);

}  // namespace clarus::render
