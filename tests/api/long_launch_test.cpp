// At 8K a desktop's GPU must not work on one launch for long: docs/devices.md, "Launches".

#include <doctest/doctest.h>

#include <algorithm>
#include <cstddef>
#include <string>
#include <vector>

#include "clarus/upscaler.h"
#include "test_device.h"

using namespace clarus;

TEST_CASE("at 8K a GPU's frame is made by launches of a tenth of a second at most") {
    const DeviceProfile own = test_device().profiles().front();
    if (own.simulator) return;
    const bool is_gpu = own.device_class == DeviceClass::gpu;
    const Device device = is_gpu ? test_device() : Device::open(test_selector() + "=gpu");
    const Size render{3840, 2160};
    const size_t pixels = static_cast<size_t>(render.width) * render.height;
    std::vector<float> color(3 * pixels, 0.5f), depth(pixels, 0.5f), motion(2 * pixels);
    std::vector<float> output(4 * 3 * pixels);
    const std::vector<std::string> models =
        is_gpu ? Model::names() : std::vector<std::string>{"enss-s-x2"};  // others take minutes on a processor
    for (const std::string& name : models) {
        CAPTURE(name);
        const Model model = Model::find(name, 2);
        if (model.scale() != 2) continue;
        UpscalerOptions options;
        options.profile = true;
        Upscaler upscaler(device, model, render, options);
        FrameDescription frame;
        frame.color = {.host = color.data(), .size = render};
        frame.depth = {.host = depth.data(), .size = render};
        frame.motion = {.host = motion.data(), .size = render};
        frame.output = {.host = output.data(), .size = upscaler.output_size()};
        frame.reset = true;
        upscaler.submit(frame).wait();
        const std::vector<StageProfile> stages = upscaler.take_profile();
        size_t most_launches = 0;
        double longest = 0;
        for (const StageProfile& stage : stages) {
            most_launches = std::max(most_launches, stage.spans.size());
            for (const StageProfile::Span& span : stage.spans) longest = std::max(longest, span.end - span.start);
        }
        CHECK(most_launches > 1);
        // How long a processor that stands for a GPU takes is another matter.
        if (is_gpu) CHECK(longest <= 0.1);
    }
}
