#pragma once

#include <vector>

#include "clarus/upscaler.h"

/// A frame of colour alone.
inline std::vector<float> upscaled(clarus::Upscaler& upscaler, std::vector<float> color, clarus::Vec2 jitter = {},
                                   float exposure = 1) {
    const clarus::Size size = upscaler.output_size();
    std::vector<float> output(static_cast<size_t>(3) * size.width * size.height);
    clarus::FrameDescription frame;
    frame.color = {.host = color.data(), .size = upscaler.render_size()};
    frame.jitter = jitter;
    frame.exposure = exposure;
    frame.output = {.host = output.data(), .size = size};
    upscaler.submit(frame).wait();
    return output;
}
