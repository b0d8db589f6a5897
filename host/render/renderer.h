#pragma once

#include "io/image.h"
#include "render/camera.h"
#include "render/scene.h"

namespace clarus::render {

constexpr int frame_rate = 60;

struct RenderSettings {
    Size render_size{480, 270};
    Size output_size{960, 540};
    bool hdr = false;               // linear radiance; else display-encoded sRGB in [0, 1]
    int samples = 1;                // of a pixel of the colour, spread over it around its jittered place
    int reference_grid = 4;         // reference samples along a pixel's side; 0: no reference
    bool output_buffers = false;    // RenderedFrame::aliased and what follows it
    float near_plane = 0.1f;        // metres; nothing nearer is seen
    float far_plane = 250;          // metres; depth 1
    float mip_bias = -1;            // of the colour; −log2(scale) by docs/conventions.md, "Jitter"
    bool motion_at_centre = false;  // else at the colour's sample position
};

/// Camera and time of a frame and of the one before.
struct FrameState {
    CameraPose camera, previous_camera;
    double seconds = 0, previous_seconds = 0;  // of the moving objects
    bool cut = false;                          // nothing is seen that was seen before: the frame resets
};

/// Depth and motion are canonical (docs/conventions.md): view distance / far_plane, the sky 1; motion in render pixels,
/// without jitter. They are those of what is opaque; an overlay has neither. Images not asked for are empty.
struct RenderedFrame {
    io::Pixels color;      // 3 channels
    io::Pixels depth;      // 1; sampled where the colour is
    io::Pixels motion;     // 2
    io::Pixels reference;  // 3 channels at the output size, the mean of a regular grid of samples
    // At the output size, one sample in the middle of each pixel:
    io::Pixels aliased, output_depth, output_motion;
};

/// Renders a frame with all threads that TBB has. The result does not depend on their number.
RenderedFrame render_frame(Scene& scene, const FrameState& frame, Vec2 jitter, const RenderSettings& settings);

}  // namespace clarus::render
