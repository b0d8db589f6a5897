#include "golden_harness.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "test_device.h"

namespace clarus::test {

Golden::Golden(const std::string& name)
    : model(Model::load(std::string(CLARUS_GOLDEN_DIR) + "/" + name + ".model.safetensors")),
      file(io::Safetensors::read(std::string(CLARUS_GOLDEN_DIR) + "/" + name + ".golden.safetensors")),
      frames(static_cast<int>(file.tensors().at("color").shape[0])),
      render{static_cast<int>(file.tensors().at("color").shape[2]),
             static_cast<int>(file.tensors().at("color").shape[1])} {}

std::vector<int32_t> Golden::resets() const {
    const auto bytes = file.tensors().at("reset").bytes;
    std::vector<int32_t> values(frames);
    std::memcpy(values.data(), bytes.data(), bytes.size());
    return values;
}

double largest_difference(const float* a, const float* b, size_t count) {
    double largest = 0;
    for (size_t i = 0; i < count; ++i) {
        const double difference = std::abs(double(a[i]) - b[i]);
        if (!(difference <= largest)) largest = difference;
    }
    return largest;
}

GoldenRun run(const Golden& golden, UpscalerOptions options, int frames) {
    std::vector<float> color = golden.tensor("color"), depth = golden.tensor("depth"), motion = golden.tensor("motion");
    const std::vector<float> jitter = golden.tensor("jitter"), expected = golden.tensor("output");
    const std::vector<int32_t> resets = golden.resets();
    options.motion.sampled_at_jitter = golden.file.has("motion_jitter");
    GoldenRun result{{}, Upscaler(test_device(), golden.model, golden.render, std::move(options))};
    const size_t pixels = static_cast<size_t>(golden.render.width) * golden.render.height;
    const Size size = result.upscaler.output_size();
    const size_t count = static_cast<size_t>(size.width) * size.height * 3;
    std::vector<float> output(count);
    for (int frame = 0; frame < (frames < 0 ? golden.frames : frames); ++frame) {
        FrameDescription description;
        description.color = {.host = color.data() + frame * pixels * 3, .size = golden.render};
        description.depth = {.host = depth.data() + frame * pixels, .size = golden.render};
        description.motion = {.host = motion.data() + frame * pixels * 2, .size = golden.render};
        description.jitter = {jitter[2 * frame], jitter[2 * frame + 1]};
        description.reset = resets[frame] != 0;
        description.output = {.host = output.data(), .size = size};
        result.upscaler.submit(description).wait();
        result.differences.push_back(largest_difference(output.data(), expected.data() + frame * count, count));
    }
    return result;
}

void check_views(const std::string& name, const std::vector<std::string>& views, double tolerance,
                 const std::map<std::string, std::string>& tensors) {
    constexpr int kFrame = 3;
    const Golden golden(name);
    UpscalerOptions options;
    options.views = views;
    const GoldenRun result = run(golden, options, kFrame + 1);
    for (const std::string& each : views) {
        CAPTURE(each);
        const Upscaler::View view = result.upscaler.view(each);
        const auto renamed = tensors.find(each);
        // Channel, row, column.
        const std::vector<float> expected = golden.tensor(renamed == tensors.end() ? each : renamed->second);
        const size_t pixels = static_cast<size_t>(view.size.width) * view.size.height;
        REQUIRE(expected.size() >= pixels * view.channels);  // the file may have more channels
        double largest = 0;
        for (int channel = 0; channel < view.channels; ++channel)
            for (size_t pixel = 0; pixel < pixels; ++pixel)
                largest = std::max(largest, std::abs(double(view.pixels[pixel * view.channels + channel]) -
                                                     expected[channel * pixels + pixel]));
        CHECK(largest < tolerance);
    }
}

}  // namespace clarus::test
