#pragma once

// A network's golden frames, run on one device or several.

#include <string>
#include <vector>

#include "cl/context.h"
#include "clarus/upscaler.h"
#include "golden.h"
#include "test_device.h"

namespace clarus::test {

using Images = std::vector<std::vector<float>>;

/// All frames of a golden file, enqueued before the first is waited for.
struct Film {
    explicit Film(const Golden& film)
        : golden(film),
          color(film.tensor("color")),
          depth(film.tensor("depth")),
          motion(film.tensor("motion")),
          jitter(film.tensor("jitter")),
          resets(film.resets()) {}

    FrameDescription frame(int number, const Upscaler& upscaler, std::vector<float>& output) {
        const size_t pixels = static_cast<size_t>(golden.render.width) * golden.render.height;
        const Size size = upscaler.output_size();
        output.resize(static_cast<size_t>(size.width) * size.height * 3);
        FrameDescription description;
        description.color = {.host = color.data() + number * pixels * 3, .size = golden.render};
        if (upscaler.needs_depth()) description.depth = {.host = depth.data() + number * pixels, .size = golden.render};
        if (upscaler.needs_motion())
            description.motion = {.host = motion.data() + number * pixels * 2, .size = golden.render};
        description.jitter = {jitter[2 * number], jitter[2 * number + 1]};
        description.reset = resets[number] != 0;
        description.output = {.host = output.data(), .size = size};
        return description;
    }

    Images run(Upscaler& upscaler) {
        Images outputs(golden.frames);
        std::vector<FrameEvent> events;
        for (int number = 0; number < golden.frames; ++number)
            events.push_back(upscaler.submit(frame(number, upscaler, outputs[number])));
        for (const FrameEvent& event : events) event.wait();
        return outputs;
    }

    const Golden& golden;
    std::vector<float> color, depth, motion, jitter;
    std::vector<int32_t> resets;
};

inline UpscalerOptions options_for(const Golden& golden, const std::string& placement = "auto") {
    UpscalerOptions options;
    options.motion.sampled_at_jitter = golden.file.has("motion_jitter");
    options.placement = placement;
    return options;
}

/// Twice the device under test, as two devices of one context.
inline Device of_one_context() {
    const ocl::Context& context = test_device().context();
    const cl::CommandQueue queue(context.context(), context.device(), CL_QUEUE_PROFILING_ENABLE);
    return Device::together({test_device(), Device::adopt(context.context()(), context.device()(), queue())});
}

/// Twice the device under test, which copies between two contexts.
inline Device of_two_contexts() { return Device::together({test_device(), Device::open(test_selector())}); }

}  // namespace clarus::test
