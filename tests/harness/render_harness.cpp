#include "render_harness.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "cli/commands.h"
#include "metrics/psnr.h"

namespace clarus::render_test {

using namespace clarus::render;
using Imath::M44d;
using Imath::V2d;
using Imath::V2f;
using Imath::V3d;
using Imath::V3f;

M44d rotation(V3d angles) {
    M44d matrix;
    matrix.rotate(angles);
    return matrix;
}

M44d translation(V3d by) {
    M44d matrix;
    matrix.setTranslation(by);
    return matrix;
}

RenderSettings small_settings() {
    RenderSettings settings;
    settings.render_size = {48, 32};
    settings.output_size = {96, 64};
    settings.reference_grid = 0;
    return settings;
}

CameraPose in_front(double distance) {
    CameraPose pose;
    pose.position = {0, 0, distance};
    return pose;
}

double focal(const CameraPose& pose, Size size) { return size.height / 2.0 / std::tan(pose.fov_y / 2); }

/// Row vectors; camera space looks along −z.
M44d camera_to_world(const CameraPose& pose) {
    return rotation({0, 0, -pose.roll}) * rotation({pose.pitch, 0, 0}) * rotation({0, -pose.yaw, 0}) *
           translation(pose.position);
}

V2d project(const CameraPose& pose, V3d world, Size size) {
    const V3d p = world * camera_to_world(pose).inverse();
    return {size.width / 2.0 + focal(pose, size) * p.x / -p.z, size.height / 2.0 - focal(pose, size) * p.y / -p.z};
}

std::shared_ptr<const Texture> plain(Rgba color) {
    return std::make_shared<Texture>(2, [=](float, float) { return color; });
}

std::shared_ptr<const Texture> smooth(float phase) {
    return std::make_shared<Texture>(7, [=](float u, float v) {
        constexpr float turn = 2 * std::numbers::pi_v<float>;
        const float a = std::sin(turn * (3 * u + 5 * v) + phase), b = std::sin(turn * (6 * u - v) + 2 * phase);
        return Rgba{0.35f + 0.25f * a, 0.35f + 0.25f * b, 0.35f + 0.12f * (a + b), 1};
    });
}

Mesh square(int material, float half_side) {
    Mesh mesh{.material = material};
    mesh.add_quad({V3f(-half_side, -half_side, 0),
                   {half_side, -half_side, 0},
                   {half_side, half_side, 0},
                   {-half_side, half_side, 0}},
                  V2f(0), V2f(1));
    return mesh;
}

Environment even_light() {
    Environment environment;
    // From above and from below the same (shade.cpp).
    environment.zenith = V3f(1);
    environment.horizon = V3f(1);
    environment.ground = V3f(0.55f);
    environment.clouds = plain({0, 0, 0, 1});
    return environment;
}

std::unique_ptr<Scene> smooth_scene() {
    auto scene = std::make_unique<Scene>();
    scene->environment = even_light();
    scene->add_static({square(scene->add_material({.texture = smooth(0.3f)}), 6)});
    Mesh ball{.material = scene->add_material({.texture = smooth(1.1f)})};
    ball.add_sphere(V3f(0), 0.8f, 48, 2);
    scene->add_moving({ball}, [](double t) {
        return rotation({0, 0.5 * t, 0.3 * t}) * translation({0.4 * t, 0.1, 1.5});
    });
    scene->build();
    return scene;
}

double psnr(const io::Pixels& a, const io::Pixels& b) { return metrics::psnr(metrics::mean_squared_error(a, b)); }

io::Pixels pooled(const io::Pixels& image, int factor) {
    io::Pixels means{{image.size.width / factor, image.size.height / factor}, image.channels, {}};
    for (int y = 0; y < means.size.height; ++y) {
        for (int x = 0; x < means.size.width; ++x) {
            for (int channel = 0; channel < image.channels; ++channel) {
                double sum = 0;
                for (int i = 0; i < factor * factor; ++i) {
                    sum += image.at(factor * x + i % factor, factor * y + i / factor, channel);
                }
                means.values.push_back(static_cast<float>(sum / (factor * factor)));
            }
        }
    }
    return means;
}

io::FramePixels read_canonical(const io::Sequence& sequence, size_t index) {
    io::FramePixels frame = io::read_frame(sequence, index, true, true);
    const io::FrameFiles& files = sequence.frames[index];
    const double n = files.near_plane, f = files.far_plane;
    for (float& value : frame.depth.values) {
        double d = value;
        if (sequence.depth.projective) {
            const double z = sequence.depth.reversed ? n * f / (n + d * (f - n)) : n * f / (f - d * (f - n));
            d = z / f;
        } else if (sequence.depth.reversed) {
            d = 1 - d;
        }
        value = static_cast<float>(d);
    }
    const io::MotionConvention& motion = sequence.motion;
    const Vec2 j = files.jitter, before = sequence.frames[index > 0 ? index - 1 : 0].jitter;
    for (size_t i = 0; i < frame.motion.values.size(); i += 2) {
        double x = frame.motion.values[i], y = frame.motion.values[i + 1];
        if (motion.from_previous) x = -x, y = -y;
        if (motion.y_up) y = -y;
        if (motion.unit == io::MotionUnit::uv) x *= sequence.render_size.width, y *= sequence.render_size.height;
        if (motion.jittered) x += before.x - j.x, y += before.y - j.y;
        frame.motion.values[i] = static_cast<float>(x);
        frame.motion.values[i + 1] = static_cast<float>(y);
    }
    return frame;
}

void run_render(std::vector<std::string> arguments) {
    CLI::App app;
    cli::add_render_command(app);
    arguments.insert(arguments.begin(), "render");
    std::ranges::reverse(arguments);
    app.parse(arguments);
}

}  // namespace clarus::render_test
