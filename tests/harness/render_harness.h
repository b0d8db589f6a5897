#pragma once

#include <Imath/ImathMatrix.h>
#include <Imath/ImathVec.h>

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "io/frames.h"
#include "io/sequence.h"
#include "render/renderer.h"

/// What the renderer's tests share: small scenes, their own arithmetic of cameras, and docs/conventions.md read
/// backwards.
namespace clarus::render_test {

using Motion = render::Scene::Motion;

Imath::M44d rotation(Imath::V3d angles);
Imath::M44d translation(Imath::V3d by);

/// Render size 48x32, output twice that, no reference.
render::RenderSettings small_settings();

/// Looks along −z at the origin.
render::CameraPose in_front(double distance);

double focal(const render::CameraPose& pose, Size size);
Imath::M44d camera_to_world(const render::CameraPose& pose);
/// To a pixel position in an image of this size.
Imath::V2d project(const render::CameraPose& pose, Imath::V3d world, Size size);

std::shared_ptr<const render::Texture> plain(render::Rgba color = {1, 1, 1, 1});
/// A sum of two waves, the shorter of them a sixth of the texture long.
std::shared_ptr<const render::Texture> smooth(float phase);

/// A square of side 2 · half_side in the xy plane around the origin, its texture once over it.
render::Mesh square(int material, float half_side);
/// Light that is the same from everywhere, a plain sky, no sun.
render::Environment even_light();

/// A smooth ball that turns and moves in front of a smooth wall; matt, in even light.
std::unique_ptr<render::Scene> smooth_scene();

double psnr(const io::Pixels& a, const io::Pixels& b);
/// Means of factor × factor pixels.
io::Pixels pooled(const io::Pixels& image, int factor);

/// Frame `index` of a sequence that was read, its depth and motion made canonical by the formulas of
/// docs/conventions.md.
io::FramePixels read_canonical(const io::Sequence& sequence, size_t index);

/// Runs `clarus render` with these arguments.
void run_render(std::vector<std::string> arguments);

}  // namespace clarus::render_test
