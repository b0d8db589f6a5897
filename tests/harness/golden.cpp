#include "golden.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

#include "test_device.h"

namespace clarus::test {
namespace {

double largest_difference(const float* a, const float* b, size_t count) {
    double largest = 0;
    for (size_t i = 0; i < count; ++i) {
        const double difference = std::abs(double(a[i]) - b[i]);
        if (!(difference <= largest)) largest = difference;  // a NaN counts as a difference
    }
    return largest;
}

}  // namespace

Golden::Golden(const std::string& name)
    : file(io::Safetensors::read(std::string(CLARUS_GOLDEN_DIR) + "/" + name + ".golden.safetensors")),
      model(Model::load(std::string(CLARUS_GOLDEN_DIR) + "/" + name + ".model.safetensors",
                        std::stod(file.require_metadata("scale")))),
      frames(static_cast<int>(file.tensors().at("color").shape[0])),
      render{static_cast<int>(file.tensors().at("color").shape[2]),
             static_cast<int>(file.tensors().at("color").shape[1])} {}

std::vector<int32_t> Golden::resets() const {
    const auto bytes = file.tensors().at("reset").bytes;
    std::vector<int32_t> values(frames);
    std::memcpy(values.data(), bytes.data(), bytes.size());
    return values;
}

Run run(const Golden& golden, UpscalerOptions options, int frames,
        const std::function<void(int, FrameDescription&)>& change) {
    std::vector<float> color = golden.tensor("color"), depth = golden.tensor("depth"), motion = golden.tensor("motion");
    const std::vector<float> jitter = golden.tensor("jitter"), expected = golden.tensor("output");
    const std::vector<int32_t> resets = golden.resets();
    options.motion.sampled_at_jitter = golden.file.has("motion_jitter");
    const int channels = options.output_format.channels;
    const bool comparable = !options.output_size && channels == 3;
    Run result{{}, {}, Upscaler(test_device(), golden.model, golden.render, std::move(options))};
    const size_t pixels = static_cast<size_t>(golden.render.width) * golden.render.height;
    const Size size = result.upscaler.output_size();
    const size_t count = static_cast<size_t>(size.width) * size.height * channels;
    for (int frame = 0; frame < (frames < 0 ? golden.frames : frames); ++frame) {
        std::vector<float>& output = result.outputs.emplace_back(count);
        FrameDescription description;
        description.color = {.host = color.data() + frame * pixels * 3, .size = golden.render};
        if (result.upscaler.needs_depth())
            description.depth = {.host = depth.data() + frame * pixels, .size = golden.render};
        if (result.upscaler.needs_motion())
            description.motion = {.host = motion.data() + frame * pixels * 2, .size = golden.render};
        description.jitter = {jitter[2 * frame], jitter[2 * frame + 1]};
        description.reset = resets[frame] != 0;
        description.output = {.host = output.data(), .size = size};
        if (change) change(frame, description);
        result.upscaler.submit(description).wait();
        if (comparable)
            result.differences.push_back(largest_difference(output.data(), expected.data() + frame * count, count));
    }
    return result;
}

double view_difference(const Upscaler& upscaler, const Golden& golden, const std::string& name) {
    const Upscaler::View view = upscaler.view(name);
    const std::vector<float> expected = golden.tensor(name);  // channel, row, column
    const size_t pixels = static_cast<size_t>(view.size.width) * view.size.height;
    REQUIRE(expected.size() >= view.pixels.size());  // it may have channels that the view does not show
    std::vector<float> planes(view.pixels.size());
    for (size_t pixel = 0; pixel < pixels; ++pixel)
        for (int channel = 0; channel < view.channels; ++channel)
            planes[channel * pixels + pixel] = view.pixels[pixel * view.channels + channel];
    return largest_difference(planes.data(), expected.data(), planes.size());
}

}  // namespace clarus::test
