#include "render/renderer.h"

#include <tbb/blocked_range2d.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "render/shade.h"

namespace clarus::render {
namespace {

using Imath::V2d;
using Imath::V3d;
using Imath::V3f;

constexpr int packet_size = 16;

/// What a ray saw.
struct Sample {
    V3f radiance;
    double view_distance;     // infinite for the sky
    const Scene::Part* part;  // null for the sky
};

class Tracer {
  public:
    Tracer(const Scene& scene, const Camera& camera) : scene_(scene), camera_(camera) {}

    /// Traces and shades rays through `count` ≤ packet_size points of the image, in render pixels.
    void trace(const V2d* points, int count, const TextureFilter& filter, Sample* samples) const {
        alignas(64) int valid[packet_size];
        alignas(64) RTCRayHit16 packet;
        Ray rays[packet_size];
        intersect(points, count, valid, packet, rays);

        alignas(64) RTCRay16 shadow;
        Surface surfaces[packet_size];
        bool any_surface = false;
        for (int i = 0; i < count; ++i) {
            valid[i] = 0;
            if (packet.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID) {
                samples[i] = {sky(scene_.environment, rays[i], filter), std::numeric_limits<double>::infinity(),
                              nullptr};
                continue;
            }
            const Hit hit = {&scene_.part(packet.hit.instID[0][i]),
                             packet.hit.geomID[i],
                             packet.hit.primID[i],
                             packet.hit.u[i],
                             packet.hit.v[i],
                             {packet.hit.Ng_x[i], packet.hit.Ng_y[i], packet.hit.Ng_z[i]}};
            rays[i].view_distance = packet.ray.tfar[i];
            samples[i] = {V3f(0), packet.ray.tfar[i], hit.part};
            surfaces[i] = surface_at(scene_, hit, rays[i], filter);
            aim_at_sun(shadow, i, rays[i], surfaces[i]);
            valid[i] = -1;
            any_surface = true;
        }
        if (!any_surface) return;
        RTCIntersectContext context;
        rtcInitIntersectContext(&context);

        rtcOccluded16(valid, scene_.embree(), &context, &shadow);
        for (int i = 0; i < count; ++i) {
            if (!valid[i]) continue;
            samples[i].radiance = shade(scene_.environment, surfaces[i], rays[i], shadow.tfar[i] >= 0);
        }
    }

    /// Distances and parts alone; `radiance` is left as it was.
    void trace_geometry(const V2d* points, int count, Sample* samples) const {
        alignas(64) int valid[packet_size];
        alignas(64) RTCRayHit16 packet;
        Ray rays[packet_size];
        intersect(points, count, valid, packet, rays);
        for (int i = 0; i < count; ++i) {
            const bool missed = packet.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID;
            samples[i].view_distance = missed ? std::numeric_limits<double>::infinity() : packet.ray.tfar[i];
            samples[i].part = missed ? nullptr : &scene_.part(packet.hit.instID[0][i]);
        }
    }

  private:
    void intersect(const V2d* points, int count, int* valid, RTCRayHit16& packet, Ray* rays) const {
        const V3f origin(camera_.position());
        for (int i = 0; i < packet_size; ++i) {
            valid[i] = i < count ? -1 : 0;
            if (!valid[i]) continue;
            rays[i].direction = V3f(camera_.direction(points[i]));
            rays[i].pixel_width = static_cast<float>(camera_.pixel_width());
            packet.ray.org_x[i] = origin.x;
            packet.ray.org_y[i] = origin.y;
            packet.ray.org_z[i] = origin.z;
            packet.ray.dir_x[i] = rays[i].direction.x;
            packet.ray.dir_y[i] = rays[i].direction.y;
            packet.ray.dir_z[i] = rays[i].direction.z;
            packet.ray.tnear[i] = 0.02f;
            packet.ray.tfar[i] = std::numeric_limits<float>::infinity();
            packet.ray.time[i] = 0;
            packet.ray.mask[i] = 0xffffffffu;
            packet.ray.flags[i] = 0;
            packet.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
            packet.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
        }
        RTCIntersectContext context;
        rtcInitIntersectContext(&context);
        context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;

        rtcIntersect16(valid, scene_.embree(), &context, &packet);
    }

    void aim_at_sun(RTCRay16& shadow, int i, const Ray& ray, const Surface& surface) const {
        const V3f& to_sun = scene_.environment.to_sun;
        const float clearance = 1e-3f + 1e-4f * ray.view_distance;
        const V3f side = (surface.facet_normal ^ to_sun) < 0 ? -surface.facet_normal : surface.facet_normal;
        const V3f origin = V3f(camera_.position()) + ray.direction * ray.view_distance + side * clearance;
        shadow.org_x[i] = origin.x;
        shadow.org_y[i] = origin.y;
        shadow.org_z[i] = origin.z;
        shadow.dir_x[i] = to_sun.x;
        shadow.dir_y[i] = to_sun.y;
        shadow.dir_z[i] = to_sun.z;
        shadow.tnear[i] = 0;
        shadow.tfar[i] = std::numeric_limits<float>::infinity();
        shadow.time[i] = 0;
        shadow.mask[i] = 0xffffffffu;
        shadow.flags[i] = 0;
    }

    const Scene& scene_;
    const Camera& camera_;
};

/// A mild curve: ½ stays nearly so, about 4 becomes white.
V3f tone_map(const V3f& radiance) {
    const auto curve = [](float x) { return std::min(1.0f, x * (1 + x / 12) / (1 + 0.5f * x)); };
    return {curve(radiance.x), curve(radiance.y), curve(radiance.z)};
}

float encode_srgb(float y) { return y <= 0.0031308f ? 12.92f * y : 1.055f * std::pow(y, 1 / 2.4f) - 0.055f; }

/// From a sum of samples (tone-mapped unless hdr) to a stored pixel.
void store(io::Pixels& image, int x, int y, const V3f& mean, bool hdr) {
    for (int channel = 0; channel < 3; ++channel) {
        image.at(x, y, channel) = hdr ? mean[channel] : encode_srgb(mean[channel]);
    }
}

V2d motion_at(const V2d& point, const Sample& sample, const Camera& camera, const Camera& previous) {
    const V3d direction = camera.direction(point);
    if (!sample.part) {
        if ((direction ^ previous.forward()) > 0) return previous.project_direction(direction) - point;
    } else {
        const V3d before = (camera.position() + direction * sample.view_distance) * sample.part->to_previous;
        if (previous.view_distance(before) > 0) return previous.project(before) - point;
    }
    // It was behind the camera: longer than the image's diagonal, so invalid.
    return {4 * camera.project_direction(camera.forward()).length() + 1, 0};
}

io::Pixels make_image(Size size, int channels) {
    return {size, channels, std::vector<float>(static_cast<size_t>(size.width) * size.height * channels)};
}

/// Calls body(x, y) for packets' corners: blocks of 4 by 4 pixels.
template <typename Body>
void for_each_block(Size size, const Body& body) {
    const int columns = (size.width + 3) / 4, rows = (size.height + 3) / 4;
    tbb::parallel_for(tbb::blocked_range2d<int>(0, rows, 4, 0, columns, 16), [&](const auto& range) {
        for (int row = range.rows().begin(); row < range.rows().end(); ++row) {
            for (int column = range.cols().begin(); column < range.cols().end(); ++column) body(4 * column, 4 * row);
        }
    });
}

void render_inputs(const Scene& scene, const Camera& camera, const Camera& previous, Vec2 jitter,
                   const RenderSettings& settings, RenderedFrame& out) {
    const Tracer tracer(scene, camera);
    const TextureFilter filter{.sample_width = 1, .level_bias = settings.mip_bias};
    const Size size = settings.render_size;
    for_each_block(size, [&](int left, int top) {
        V2d points[packet_size];
        Sample samples[packet_size];
        int count = 0;
        const int right = std::min(left + 4, size.width), bottom = std::min(top + 4, size.height);
        for (int y = top; y < bottom; ++y) {
            for (int x = left; x < right; ++x) points[count++] = {x + 0.5 + jitter.x, y + 0.5 + jitter.y};
        }
        tracer.trace(points, count, filter, samples);
        int i = 0;
        for (int y = top; y < bottom; ++y) {
            for (int x = left; x < right; ++x, ++i) {
                const V3f& radiance = samples[i].radiance;
                store(out.color, x, y, settings.hdr ? radiance : tone_map(radiance), settings.hdr);
                out.depth.at(x, y, 0) =
                    static_cast<float>(std::min(1.0, samples[i].view_distance / settings.far_plane));
            }
        }
        if (settings.motion_at_centre) {
            for (V2d& point : points) point -= V2d(jitter.x, jitter.y);
            tracer.trace_geometry(points, count, samples);
        }
        i = 0;
        for (int y = top; y < bottom; ++y) {
            for (int x = left; x < right; ++x, ++i) {
                const V2d motion = motion_at(points[i], samples[i], camera, previous);
                out.motion.at(x, y, 0) = static_cast<float>(motion.x);
                out.motion.at(x, y, 1) = static_cast<float>(motion.y);
            }
        }
    });
}

void render_reference(const Scene& scene, const Camera& camera, const RenderSettings& settings, io::Pixels& out) {
    const Tracer tracer(scene, camera);
    const Size size = settings.output_size;
    const V2d pixel(static_cast<double>(settings.render_size.width) / size.width,
                    static_cast<double>(settings.render_size.height) / size.height);
    const int grid = settings.reference_grid, samples_a_pixel = grid * grid;
    const TextureFilter filter{.sample_width = static_cast<float>(pixel.y / grid), .max_anisotropy = 2};
    for_each_block(size, [&](int left, int top) {
        V2d points[packet_size];
        Sample samples[packet_size];
        const int right = std::min(left + 4, size.width), bottom = std::min(top + 4, size.height);
        for (int y = top; y < bottom; ++y) {
            for (int x = left; x < right; ++x) {
                V3f sum(0);
                for (int first = 0; first < samples_a_pixel; first += packet_size) {
                    const int count = std::min(packet_size, samples_a_pixel - first);
                    for (int i = 0; i < count; ++i) {
                        const int index = first + i;
                        points[i] = {(x + (index % grid + 0.5) / grid) * pixel.x,
                                     (y + (index / grid + 0.5) / grid) * pixel.y};
                    }
                    tracer.trace(points, count, filter, samples);
                    for (int i = 0; i < count; ++i) {
                        sum += settings.hdr ? samples[i].radiance : tone_map(samples[i].radiance);
                    }
                }
                store(out, x, y, sum / static_cast<float>(samples_a_pixel), settings.hdr);
            }
        }
    });
}

}  // namespace

RenderedFrame render_frame(Scene& scene, const FrameState& frame, Vec2 jitter, const RenderSettings& settings) {
    scene.set_time(frame.seconds, frame.previous_seconds);
    const Camera camera(frame.camera, settings.render_size), previous(frame.previous_camera, settings.render_size);
    RenderedFrame out;
    out.color = make_image(settings.render_size, 3);
    out.depth = make_image(settings.render_size, 1);
    out.motion = make_image(settings.render_size, 2);
    render_inputs(scene, camera, previous, jitter, settings, out);
    if (settings.reference_grid > 0) {
        out.reference = make_image(settings.output_size, 3);
        render_reference(scene, camera, settings, out.reference);
    }
    return out;
}

}  // namespace clarus::render
