#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "clarus/upscaler.h"
#include "io/safetensors.h"

namespace clarus::test {

/// A model, inputs, and what the PyTorch network makes of them (pipelines/training/clarus_training/golden.py).
struct Golden {
    explicit Golden(const std::string& name);

    std::vector<float> tensor(const std::string& name) const { return file.tensors().at(name).floats(); }
    std::vector<int32_t> resets() const;

    io::Safetensors file;
    Model model;  // of the scale that the file says
    int frames;
    Size render;
};

struct Run {
    std::vector<double> differences;          // from the golden file's output, the largest of each frame
    std::vector<std::vector<float>> outputs;  // of each frame
    Upscaler upscaler;
};

/// All frames of a golden file through the upscaler, or the first so many, with what it needs. Motion is sampled where
/// the file says. With an output size of the options', or alpha, there are no differences. `change` may add to a frame
/// before it is submitted.
Run run(const Golden& golden, UpscalerOptions options = {}, int frames = -1,
        const std::function<void(int, FrameDescription&)>& change = {});

/// The frame whose intermediates golden files hold.
constexpr int kViewedFrame = 3;

/// The largest difference between a view of the last frame and the golden file's tensor of that name.
double view_difference(const Upscaler& upscaler, const Golden& golden, const std::string& name);

}  // namespace clarus::test
