#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "clarus/upscaler.h"
#include "io/safetensors.h"

namespace clarus::test {

/// A model with random weights, inputs, and what the PyTorch network makes of them (clarus_training/golden.py).
struct Golden {
    explicit Golden(const std::string& name);

    std::vector<float> tensor(const std::string& name) const { return file.tensors().at(name).floats(); }
    std::vector<int32_t> resets() const;

    Model model;
    io::Safetensors file;
    int frames;
    Size render;
};

struct GoldenRun {
    std::vector<double> differences;  // the largest of each frame
    Upscaler upscaler;
};

/// All frames of a golden file, or the first few, through the upscaler.
GoldenRun run(const Golden& golden, UpscalerOptions options = {}, int frames = -1);

/// Checks views against what the golden file holds of frame 3. `names`: the view's, and the tensor's where another.
void check_views(const std::string& golden, const std::vector<std::string>& views, double tolerance,
                 const std::map<std::string, std::string>& tensors = {});

/// NaN counts as a difference.
double largest_difference(const float* a, const float* b, size_t count);

}  // namespace clarus::test
