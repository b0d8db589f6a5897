#pragma once

#include "render/renderer.h"

namespace clarus::render {

// The beat of every camera: it moves, starting and stopping gently, then stands still, so that whoever learns from the
// pictures sees both.
constexpr double time_step = 1.0 / frame_rate;
constexpr int moving_frames = 32, still_frames = 16, cycle_frames = moving_frames + still_frames;

/// Seconds that a camera moves in the first `frames` of a moving stretch: its speed rises and falls over 6 frames.
double eased_seconds(int frames);

}  // namespace clarus::render
