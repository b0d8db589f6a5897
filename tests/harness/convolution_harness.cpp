#include "convolution_harness.h"

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "test_device.h"

namespace clarus::test {

graph::Parameters random_parameters(int out_channels, int in_channels, int kernel, int sets, std::mt19937& random,
                                    int groups, int stride) {
    const float largest = 2 / (kernel * std::sqrt(static_cast<float>(in_channels) / groups));
    std::uniform_real_distribution<float> weight(-largest, largest), bias(-0.5f, 0.5f);
    graph::Parameters parameters{out_channels, in_channels, sets, sets > 1, kernel, groups, stride};
    parameters.weights.resize(parameters.weights_per_set() * sets);
    parameters.biases.resize(static_cast<size_t>(out_channels) * sets);
    for (float& value : parameters.weights) value = weight(random);
    for (float& value : parameters.biases) value = bias(random);
    return parameters;
}

Planes expected_convolution(const Planes& image, const graph::Parameters& parameters, int set,
                            graph::Activation activation, Size size) {
    const auto [channels, height, width] = image.shape;
    const int kernel = parameters.kernel, stride = parameters.stride, group = channels / parameters.groups;
    const graph::Shape shape{parameters.out_channels, (size.height + stride - 1) / stride,
                             (size.width + stride - 1) / stride};
    return planes(shape, [&](int out, int x, int y) -> float {
        double sum = parameters.biases[static_cast<size_t>(set) * parameters.out_channels + out];
        const int first = out / (parameters.out_channels / parameters.groups) * group;
        for (int in = 0; in < group; ++in) {
            for (int ky = 0; ky < kernel; ++ky) {
                for (int kx = 0; kx < kernel; ++kx) {
                    const int px = stride * x + kx - kernel / 2, py = stride * y + ky - kernel / 2;
                    if (px < 0 || px >= width || py < 0 || py >= height) continue;
                    const size_t weight = parameters.weights_per_set() * set +
                                          ((static_cast<size_t>(out) * group + in) * kernel + ky) * kernel + kx;
                    sum += double(image.at(first + in, px, py)) * parameters.weights[weight];
                }
            }
        }
        return activation == graph::Activation::relu ? std::max(sum, 0.0) : sum;
    });
}

float convolution_tolerance(const runtime::Implementation& implementation, const runtime::Choices& choices) {
    // In half: sums below 2 are rounded to multiples of 2⁻¹⁰. Of the 198 roundings for 22 channels the standard
    // deviation is 2⁻¹⁰ · √(198 / 12) = 0.004 at most; they are smaller where the sums are.
    if (choices.contains("HALF")) return 1e-2f;
    return implementation.name == "winograd" ? 5e-5f : 1e-5f;
}

void visit_implementations(const runtime::Problem& problem, bool all_choices, const VisitImplementation& visit) {
    const DeviceProfile profile = test_device().profile();
    const bool is_dense = problem.parameters->groups == 1 && problem.parameters->stride == 1;
    const bool preferred_only =
        !is_dense || (profile.device_class == DeviceClass::cpu && profile.float_vector_width == 1);
    for (const runtime::Implementation& implementation : runtime::convolution_implementations()) {
        const bool needs_ability = implementation.name == "bf16";
        if ((preferred_only || needs_ability) && implementation.preference(problem, profile) == 0) continue;
        std::vector<runtime::Choices> choices = implementation.choices(problem, profile);
        if (!all_choices && !choices.empty()) choices.resize(1);
        for (const runtime::Choices& choice : choices) {
            std::string chosen = implementation.name;
            for (const auto& [name, value] : choice) chosen += fmt::format(" {}={}", name, value);
            CAPTURE(chosen);
            visit(implementation, choice);
        }
    }
}

}  // namespace clarus::test
