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

/// The texture's mean over the ellipse that a step to the next sample in either direction, as (u, v), spans: trilinear
/// lookups along its long axis.
V4f filtered(const Texture& texture, V2f uv, V2f right, V2f down, const TextureFilter& filter) {
    const V2f size = texture.size(), a = right * size, b = down * size;
    // The axes' squared lengths are the eigenvalues of the matrix [xx xy; xy yy].
    const float xx = a.x * a.x + b.x * b.x, xy = a.x * a.y + b.x * b.y, yy = a.y * a.y + b.y * b.y;
    const float mean = (xx + yy) / 2, spread = std::sqrt((xx - yy) * (xx - yy) / 4 + xy * xy);
    const float long_side = std::sqrt(mean + spread), short_side = std::sqrt(std::max(0.0f, mean - spread));
    const int taps = std::clamp(static_cast<int>(std::ceil(long_side / std::max(short_side, 1e-6f) - 0.25f)), 1,
                                filter.max_anisotropy);
    const float texels = std::max(short_side, long_side / static_cast<float>(taps));
    const float level = std::log2(std::max(texels, 1e-6f)) + filter.level_bias;
    if (taps == 1) return texture.sample(uv, level);
    const V2f axis = xx > yy ? V2f(mean + spread - yy, xy) : V2f(xy, mean + spread - xx);
    const V2f step = axis.normalized() * (long_side / static_cast<float>(taps)) / size;
    V4f sum(0);
    for (int tap = 0; tap < taps; ++tap) {
        sum += texture.sample(uv + step * (static_cast<float>(tap) + 0.5f - static_cast<float>(taps) / 2), level);
    }
    return sum / static_cast<float>(taps);
}

}  // namespace

Surface surface_at(const Scene& scene, const Hit& hit, const Ray& ray, const TextureFilter& filter) {
    const Mesh& mesh = hit.part->model[hit.mesh];
    const auto [a, b, c] = mesh.triangles[hit.triangle];
    const float wa = 1 - hit.u - hit.v;
    const auto interpolate = [&](const auto& values) { return values[a] * wa + values[b] * hit.u + values[c] * hit.v; };

    const V3f facet = hit.facet_normal.normalized() * hit.part->rotation;
    const float cosine = ray.direction ^ facet, towards_viewer = cosine > 0 ? -1.0f : 1.0f;
    // A step of the ray's direction moves the hit by distance · (step − direction · lengthening), in the facet's plane.
    const float steep = std::copysign(std::max(std::abs(cosine), 1e-3f), cosine);
    const float lengthening_right = (ray.step_right ^ facet) / steep,
                lengthening_down = (ray.step_down ^ facet) / steep;
    const auto& gradients = hit.part->uv_gradients[hit.mesh][hit.triangle];
    const V3f du = gradients[0] * hit.part->rotation, dv = gradients[1] * hit.part->rotation;
    const V2f along = V2f(du ^ ray.direction, dv ^ ray.direction) * ray.view_distance;
    const V2f right = V2f(du ^ ray.step_right, dv ^ ray.step_right) * ray.view_distance - along * lengthening_right;
    const V2f down = V2f(du ^ ray.step_down, dv ^ ray.step_down) * ray.view_distance - along * lengthening_down;

    const Material& material = scene.material(mesh.material);
    const V4f texel = filtered(*material.texture, interpolate(mesh.uvs), right, down, filter);
    Surface surface;
    surface.material = &material;
    surface.facet_normal = facet * towards_viewer;
    const V3f normal = interpolate(mesh.normals).normalized() * hit.part->rotation;
    surface.normal = (normal ^ surface.facet_normal) < 0 ? -normal : normal;
    surface.albedo = material.tint * V3f(texel.x, texel.y, texel.z);
    surface.alpha = material.blended ? texel.w * material.opacity : 1;
    surface.openness = interpolate(hit.part->openness[hit.mesh]);
    return surface;
}

Shaded shade(const Environment& environment, const Surface& surface, const Ray& ray, bool sunlit) {
    const Material& material = *surface.material;
    const float ray_length = ray.direction.length();
    const V3f view = ray.direction / -ray_length;
    const float to_sun = surface.normal ^ environment.to_sun;

    const float upwards = surface.normal.y * 0.5f + 0.5f;
    V3f light = mix(environment.ground, environment.zenith * 0.35f + environment.horizon * 0.2f, upwards);
    light *= surface.openness;
    if (sunlit) {
        const bool thin = material.cutout || material.blended;
        light += environment.sun * (thin ? 0.35f + 0.65f * std::abs(to_sun) : std::max(0.0f, to_sun));
    }
    Shaded shaded{surface.albedo * (light + V3f(material.emission)) * surface.alpha, 1 - surface.alpha};

    if (material.mirror > 0) {
        const float cosine = std::clamp(surface.normal ^ view, 0.0f, 1.0f), away = 1 - cosine;
        const float fresnel = material.mirror + (1 - material.mirror) * away * away * away * away * away;
        const V3f mirrored = surface.normal * (2 * cosine) - view;
        shaded.radiance = mix(shaded.radiance, sky_gradient(environment, mirrored.y) * surface.openness, fresnel);
        shaded.transmittance *= 1 - fresnel;
    }
    if (material.highlight > 0 && sunlit && to_sun > 0) {
        const V3f half = (view + environment.to_sun).normalized();
        const float exponent = static_cast<float>(1 << material.sharpness);
        const float lobe = repeated_square(std::max(0.0f, surface.normal ^ half), material.sharpness);
        shaded.radiance += environment.sun * (material.highlight * lobe * (exponent + 8) / 64);
    }
    const float clear = std::exp(-environment.haze * ray.view_distance * ray_length);
    shaded.radiance = mix(environment.horizon * (1 - shaded.transmittance), shaded.radiance, clear);
    return shaded;
}

V3f sky(const Environment& environment, const Ray& ray, const TextureFilter& filter) {
    const float length = ray.direction.length();
    const V3f direction = ray.direction / length;
    V3f radiance = sky_gradient(environment, direction.y);
    if (direction.y > 0.02f) {
        // A flat layer of clouds one unit up; a repetition of the texture is `cloud_repeat` units wide.
        constexpr float cloud_repeat = 5;
        const V2f uv = V2f(direction.x, direction.z) / (direction.y * cloud_repeat);
        const float width = ray.step_down.length() / length / (direction.y * direction.y * cloud_repeat);
        const float level = std::log2(width * environment.clouds->size().x) + filter.level_bias;
        const float cover = environment.clouds->sample(uv, level).x * std::min(1.0f, 3 * (direction.y - 0.02f));
        radiance = mix(radiance, V3f(0.95f, 0.95f, 0.97f), cover);
    }
    const float to_sun = std::max(0.0f, direction ^ environment.to_sun);
    if (to_sun > 0.9997f) return radiance + environment.sun * 12;
    return radiance + environment.sun * (0.25f * repeated_square(to_sun, 7));
}

}  // namespace clarus::render
