#include "render/shade.h"

#include <algorithm>
#include <cmath>

namespace clarus::render {
namespace {

using Imath::V2f;
using Imath::V3f;
using Imath::V4f;

V3f mix(const V3f& a, const V3f& b, float t) { return a + (b - a) * t; }

/// x to the power of 2^doublings.
float repeated_square(float x, int doublings) {
    for (; doublings > 0; --doublings) x *= x;
    return x;
}

V3f sky_gradient(const Environment& environment, float height) {
    if (height < 0) return mix(environment.horizon, environment.ground, std::min(1.0f, -4 * height));
    return mix(environment.horizon, environment.zenith, std::sqrt(height));
}

/// The texture's mean over the ellipse in which the beam of a sample cuts the surface: `taps` trilinear lookups along
/// its long side.
V4f filtered(const Texture& texture, V2f uv, V2f along, V2f across, const TextureFilter& filter) {
    const V2f size = texture.size();
    float long_side = (along * size).length(), short_side = (across * size).length();
    if (short_side > long_side) {
        std::swap(along, across);
        std::swap(long_side, short_side);
    }
    const int taps = std::clamp(static_cast<int>(std::ceil(long_side / std::max(short_side, 1e-6f) - 0.25f)), 1,
                                filter.max_anisotropy);
    const float texels = std::max(short_side, long_side / static_cast<float>(taps));
    const float level = std::log2(std::max(texels, 1e-6f)) + filter.level_bias;
    if (taps == 1) return texture.sample(uv, level);
    V4f sum(0);
    for (int tap = 0; tap < taps; ++tap) {
        const float offset = (static_cast<float>(tap) + 0.5f) / static_cast<float>(taps) - 0.5f;
        sum += texture.sample(uv + along * offset, level);
    }
    return sum / static_cast<float>(taps);
}

}  // namespace

Surface surface_at(const Scene& scene, const Hit& hit, const Ray& ray, const TextureFilter& filter) {
    const Mesh& mesh = hit.part->model[hit.mesh];
    const auto [a, b, c] = mesh.triangles[hit.triangle];
    const float wa = 1 - hit.u - hit.v;
    const auto interpolate = [&](const auto& values) { return values[a] * wa + values[b] * hit.u + values[c] * hit.v; };

    const V3f facet = hit.facet_normal.normalized();
    const V3f view = (ray.direction * hit.part->inverse_rotation).normalized();
    const float cosine = view ^ facet, towards_viewer = cosine > 0 ? -1.0f : 1.0f;

    const float width = ray.view_distance * ray.pixel_width * filter.sample_width;
    const V3f grazing = view - facet * cosine;
    const float sine = grazing.length();
    V3f along, across;
    if (sine > 1e-4f) {
        along = grazing * (width / (sine * std::max(std::abs(cosine), 1e-3f)));
        across = (facet % grazing) * (width / sine);
    } else {
        along = (std::abs(facet.x) < 0.9f ? V3f(1, 0, 0) % facet : V3f(0, 1, 0) % facet).normalized() * width;
        across = facet % along;
    }
    const auto& [du, dv] = hit.part->uv_gradients[hit.mesh][hit.triangle];
    const Material& material = scene.material(mesh.material);

    Surface surface;
    surface.material = &material;
    surface.facet_normal = facet * hit.part->rotation * towards_viewer;
    V3f normal = interpolate(mesh.normals).normalized() * hit.part->rotation;
    surface.normal = (normal ^ surface.facet_normal) < 0 ? -normal : normal;
    const V4f texel = filtered(*material.texture, interpolate(mesh.uvs), {along ^ du, along ^ dv},
                               {across ^ du, across ^ dv}, filter);
    surface.albedo = material.tint * V3f(texel.x, texel.y, texel.z);
    return surface;
}

V3f shade(const Environment& environment, const Surface& surface, const Ray& ray, bool sunlit) {
    const Material& material = *surface.material;
    const float ray_length = ray.direction.length();
    const V3f view = ray.direction / -ray_length;
    const float to_sun = surface.normal ^ environment.to_sun;

    const float upwards = surface.normal.y * 0.5f + 0.5f;
    V3f light = mix(environment.ground, environment.zenith * 0.35f + environment.horizon * 0.2f, upwards);
    if (sunlit) {
        const float lit = material.cutout ? 0.35f + 0.65f * std::abs(to_sun) : std::max(0.0f, to_sun);
        light += environment.sun * lit;
    }
    V3f radiance = surface.albedo * light + surface.albedo * material.emission;

    if (material.highlight > 0 && sunlit && to_sun > 0) {
        const V3f half = (view + environment.to_sun).normalized();
        const float exponent = static_cast<float>(1 << material.sharpness);
        const float lobe = repeated_square(std::max(0.0f, surface.normal ^ half), material.sharpness);
        radiance += environment.sun * (material.highlight * lobe * (exponent + 8) / 64);
    }
    if (material.mirror > 0) {
        const float cosine = std::clamp(surface.normal ^ view, 0.0f, 1.0f), away = 1 - cosine;
        const float fresnel = material.mirror + (1 - material.mirror) * away * away * away * away * away;
        const V3f mirrored = surface.normal * (2 * cosine) - view;
        radiance = mix(radiance, sky_gradient(environment, mirrored.y), fresnel);
    }
    const float clear = std::exp(-environment.haze * ray.view_distance * ray_length);
    return mix(environment.horizon, radiance, clear);
}

V3f sky(const Environment& environment, const Ray& ray, const TextureFilter& filter) {
    const float length = ray.direction.length();
    const V3f direction = ray.direction / length;
    V3f radiance = sky_gradient(environment, direction.y);
    if (direction.y > 0.02f) {
        // A flat layer of clouds one unit up; a repetition of the texture is `cloud_repeat` units wide.
        constexpr float cloud_repeat = 5;
        const V2f uv = V2f(direction.x, direction.z) / (direction.y * cloud_repeat);
        const float width = ray.pixel_width / length * filter.sample_width / (direction.y * direction.y * cloud_repeat);
        const float level = std::log2(width * environment.clouds->size().x) + filter.level_bias;
        const float cover = environment.clouds->sample(uv, level).x * std::min(1.0f, 3 * (direction.y - 0.02f));
        radiance = mix(radiance, V3f(0.95f, 0.95f, 0.97f), cover);
    }
    const float to_sun = std::max(0.0f, direction ^ environment.to_sun);
    if (to_sun > 0.9997f) return radiance + environment.sun * 12;
    return radiance + environment.sun * (0.25f * repeated_square(to_sun, 7));
}

}  // namespace clarus::render
