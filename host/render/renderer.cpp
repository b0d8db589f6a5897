#include "render/renderer.h"

#include <tbb/blocked_range2d.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <span>
#include <vector>

#include "base/srgb.h"
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

io::Pixels make_image(Size size, int channels) {
    return {size, channels, std::vector<float>(static_cast<size_t>(size.width) * size.height * channels)};
}

/// Where an image's pixels are: pixel (x, y) is sampled around (x + ½, y + ½) · pitch + offset, in render pixels.
struct Grid {
    Size size;
    V2d pitch{1}, offset{0};

    V2d at(int x, int y, const V2d& within_pixel = V2d(0)) const {
        return (V2d(x + 0.5, y + 0.5) + within_pixel) * pitch + offset;
    }
};

using Pattern = std::vector<V2d>;  // places of samples around a pixel's, in its pixels

Pattern regular_grid(int side) {
    Pattern pattern;
    for (int i = 0; i < side * side; ++i) pattern.push_back(V2d(i % side + 0.5, i / side + 0.5) / side - V2d(0.5));
    return pattern;
}

/// Hammersley's points, moved so that their mean is the pixel's place.
Pattern spread_evenly(int count) {
    Pattern pattern;
    V2d sum(0);
    for (int i = 0; i < count; ++i) {
        double y = 0, weight = 0.5;
        for (int digits = i; digits > 0; digits /= 2, weight /= 2) y += digits % 2 * weight;
        pattern.push_back({static_cast<double>(i) / count, y});
        sum += pattern.back();
    }
    for (V2d& place : pattern) place -= sum / count;
    return pattern;
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

class FrameRenderer {
  public:
    FrameRenderer(const Scene& scene, const FrameState& frame, const RenderSettings& settings)
        : scene_(scene),
          settings_(settings),
          camera_(frame.camera, settings.render_size),
          previous_(frame.previous_camera, settings.render_size),
          tracer_(scene, camera_, settings.near_plane) {}

    io::Pixels color(const Grid& grid, const Pattern& pattern, const TextureFilter& filter) const {
        io::Pixels image = make_image(grid.size, 3);
        for_each_block(grid.size, [&](const std::vector<PixelPosition>& pixels) {
            std::array<V3f, Tracer::packet_size> sums;
            sums.fill(V3f(0));
            add_samples(grid, pattern, filter, pixels, sums);
            for (size_t i = 0; i < pixels.size(); ++i) {
                const V3f mean = sums[i] / static_cast<float>(pattern.size());
                for (int channel = 0; channel < 3; ++channel) {
                    image.at(pixels[i].x, pixels[i].y, channel) =
                        settings_.hdr ? mean[channel] : encode_srgb(mean[channel]);
                }
            }
        });
        return image;
    }

    /// Images to be made; those that are null are not.
    void geometry(const Grid& grid, io::Pixels* depth, io::Pixels* motion) const {
        if (depth) *depth = make_image(grid.size, 1);
        if (motion) *motion = make_image(grid.size, 2);
        for_each_block(grid.size, [&](const std::vector<PixelPosition>& pixels) {
            std::vector<V2d> points;
            for (const auto [x, y] : pixels) points.push_back(grid.at(x, y));
            std::array<Sample, Tracer::packet_size> samples;
            tracer_.trace_geometry(points, samples);
            for (size_t i = 0; i < pixels.size(); ++i) {
                const auto [x, y] = pixels[i];
                if (depth) {
                    depth->at(x, y, 0) =
                        static_cast<float>(std::min(1.0, samples[i].view_distance / settings_.far_plane));
                }
                if (motion) {
                    const V2d vector = motion_at(points[i], samples[i]);
                    motion->at(x, y, 0) = static_cast<float>(vector.x);
                    motion->at(x, y, 1) = static_cast<float>(vector.y);
                }
            }
        });
    }

  private:
    /// Adds the samples of each of the pixels to its sum, tone-mapped unless they stay radiance.
    void add_samples(const Grid& grid, const Pattern& pattern, const TextureFilter& filter,
                     const std::vector<PixelPosition>& pixels, std::span<V3f> sums) const {
        const size_t count = pixels.size() * pattern.size();
        std::vector<V2d> points;
        std::array<Sample, Tracer::packet_size> samples;
        for (size_t first = 0; first < count; first += points.size()) {
            points.clear();
            for (size_t k = first; k < std::min(first + Tracer::packet_size, count); ++k) {
                const auto [x, y] = pixels[k / pattern.size()];
                points.push_back(grid.at(x, y, pattern[k % pattern.size()]));
            }
            tracer_.trace(points, filter, samples);
            for (size_t i = 0; i < points.size(); ++i) {
                const V3f& radiance = samples[i].radiance;
                sums[(first + i) / pattern.size()] +=
                    overlaid(settings_.hdr ? radiance : tone_map(radiance), points[i]);
            }
        }
    }

    V3f overlaid(const V3f& color, const V2d& point) const {
        if (!scene_.overlay) return color;
        const Size size = settings_.render_size;
        const auto place = [](double x, int extent) {
            return static_cast<float>(std::clamp(x / extent, 0.0, 1 - 0x1p-24));
        };
        const auto [r, g, b, a] = scene_.overlay({place(point.x, size.width), place(point.y, size.height)});
        if (a <= 0) return color;
        return color * (1 - a) + V3f(decode_srgb(r), decode_srgb(g), decode_srgb(b)) * a;
    }

    V2d motion_at(const V2d& point, const Sample& sample) const {
        if (!sample.part) {
            const V3d direction = camera_.direction(point);
            if ((direction ^ previous_.forward()) > 0) return previous_.project_direction(direction) - point;
        } else if (previous_.view_distance(sample.before) > 0) {
            return previous_.project(sample.before) - point;
        }
        // It was behind the camera: longer than the image's diagonal, so invalid.
        return {4 * camera_.project_direction(camera_.forward()).length() + 1, 0};
    }

    const Scene& scene_;
    const RenderSettings& settings_;
    const Camera camera_, previous_;
    const Tracer tracer_;
};

}  // namespace

RenderedFrame render_frame(Scene& scene, const FrameState& frame, Vec2 jitter, const RenderSettings& settings) {
    scene.set_time(frame.seconds, frame.previous_seconds);
    const FrameRenderer renderer(scene, frame, settings);
    const Grid centres{settings.render_size}, jittered{settings.render_size, V2d(1), V2d(jitter.x, jitter.y)};
    RenderedFrame out;
    out.color = renderer.color(jittered, spread_evenly(settings.samples), {.level_bias = settings.mip_bias});
    renderer.geometry(jittered, &out.depth, settings.motion_at_centre ? nullptr : &out.motion);
    if (settings.motion_at_centre) renderer.geometry(centres, nullptr, &out.motion);

    const Grid output{settings.output_size,
                      V2d(static_cast<double>(settings.render_size.width) / settings.output_size.width,
                          static_cast<double>(settings.render_size.height) / settings.output_size.height)};
    const float width = static_cast<float>(output.pitch.y);
    if (settings.reference_grid > 0) {
        out.reference = renderer.color(output, regular_grid(settings.reference_grid),
                                       {.sample_width = width / settings.reference_grid, .max_anisotropy = 2});
    }
    if (settings.output_buffers) {
        out.aliased = renderer.color(output, spread_evenly(1), {.sample_width = width});
        renderer.geometry(output, &out.output_depth, &out.output_motion);
    }
    return out;
}

}  // namespace clarus::render
