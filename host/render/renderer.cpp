#include "render/renderer.h"

#include <tbb/blocked_range2d.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "render/tracer.h"

namespace clarus::render {
namespace {

using Imath::V2d;
using Imath::V3d;
using Imath::V3f;

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

struct PixelPosition {
    int x, y;
};

/// Calls body(pixels) for blocks of at most 4 by 4 pixels, a packet at one sample a pixel.
template <typename Body>
void for_each_block(Size size, const Body& body) {
    const int columns = (size.width + 3) / 4, rows = (size.height + 3) / 4;
    tbb::parallel_for(tbb::blocked_range2d<int>(0, rows, 4, 0, columns, 16), [&](const auto& range) {
        std::vector<PixelPosition> pixels;
        for (int row = range.rows().begin(); row < range.rows().end(); ++row) {
            for (int column = range.cols().begin(); column < range.cols().end(); ++column) {
                pixels.clear();
                for (int y = 4 * row; y < std::min(4 * row + 4, size.height); ++y) {
                    for (int x = 4 * column; x < std::min(4 * column + 4, size.width); ++x) pixels.push_back({x, y});
                }
                body(pixels);
            }
        }
    });
}

void render_inputs(const Scene& scene, const Camera& camera, const Camera& previous, Vec2 jitter,
                   const RenderSettings& settings, RenderedFrame& out) {
    const Tracer tracer(scene, camera);
    const TextureFilter filter{.sample_width = 1, .level_bias = settings.mip_bias};
    for_each_block(settings.render_size, [&](const std::vector<PixelPosition>& pixels) {
        std::vector<V2d> points;
        for (const auto [x, y] : pixels) points.emplace_back(x + 0.5 + jitter.x, y + 0.5 + jitter.y);
        std::array<Sample, Tracer::packet_size> samples;
        tracer.trace(points, filter, samples);
        for (size_t i = 0; i < pixels.size(); ++i) {
            const auto [x, y] = pixels[i];
            const V3f& radiance = samples[i].radiance;
            store(out.color, x, y, settings.hdr ? radiance : tone_map(radiance), settings.hdr);
            out.depth.at(x, y, 0) = static_cast<float>(std::min(1.0, samples[i].view_distance / settings.far_plane));
        }
        if (settings.motion_at_centre) {
            for (V2d& point : points) point -= V2d(jitter.x, jitter.y);
            tracer.trace_geometry(points, samples);
        }
        for (size_t i = 0; i < pixels.size(); ++i) {
            const auto [x, y] = pixels[i];
            const V2d motion = motion_at(points[i], samples[i], camera, previous);
            out.motion.at(x, y, 0) = static_cast<float>(motion.x);
            out.motion.at(x, y, 1) = static_cast<float>(motion.y);
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
    for_each_block(size, [&](const std::vector<PixelPosition>& pixels) {
        std::vector<V2d> points;
        std::array<Sample, Tracer::packet_size> samples;
        for (const auto [x, y] : pixels) {
            V3f sum(0);
            for (int first = 0; first < samples_a_pixel; first += Tracer::packet_size) {
                points.clear();
                for (int i = first; i < std::min(first + Tracer::packet_size, samples_a_pixel); ++i) {
                    points.emplace_back((x + (i % grid + 0.5) / grid) * pixel.x,
                                        (y + (i / grid + 0.5) / grid) * pixel.y);
                }
                tracer.trace(points, filter, samples);
                for (size_t i = 0; i < points.size(); ++i) {
                    sum += settings.hdr ? samples[i].radiance : tone_map(samples[i].radiance);
                }
            }
            store(out, x, y, sum / static_cast<float>(samples_a_pixel), settings.hdr);
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
