#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "runtime/implementations/lowering.h"

namespace clarus::runtime {
namespace {

/// The camera's vertical field of view is taken as 60°.
constexpr double kTangent = 0.57735026918962576;
/// How far surfaces beside each other are apart, for each pixel of the image's diagonal, in view depths.
constexpr double kSeparation = 1.37e-5;
constexpr int kWeighed = 9;

KernelCall call_of(std::string file, std::string entry, const Problem& problem, const Choices& choices) {
    KernelCall call;
    call.file = std::move(file);
    call.entry = std::move(entry);
    call.global = pixels(problem.output);
    call.local = group_size(choices);
    return call;
}

void pass_inputs(KernelCall& call, int first, int end) {
    for (int input = first; input < end; ++input) call.arguments.push_back({ArgumentKind::input, input});
    call.arguments.push_back({ArgumentKind::output});
}

Lowered lower_far(const Problem& problem, const Choices& choices) {
    KernelCall call = call_of("nss_guide", "far_depth", problem, choices);
    call.options = "-DFAR";
    add_tensor(call, "OUT", problem.output);
    call.arguments = {{ArgumentKind::output}};
    return {std::move(call), std::nullopt};
}

Lowered lower_scatter(const Problem& problem, const Choices& choices) {
    KernelCall call = call_of("nss_guide", "scatter_depth", problem, choices);
    call.options = "-DSCATTER";
    add_tensor(call, "DEPTH", problem.inputs[1]);
    add_tensor(call, "MOTION", problem.inputs[2]);
    add_tensor(call, "OUT", problem.output);
    pass_inputs(call, 1, 3);
    call.arguments.push_back({ArgumentKind::frame});
    return {std::move(call), std::nullopt};
}

/// The view ray through a pixel, relative to the view's middle, as the gym has it: rows along the horizontal tangent.
double ray_length(double row, double column, double aspect) {
    return std::hypot(1.0, kTangent * aspect * row, kTangent * column);
}

Lowered lower_guide(const Problem& problem, const Choices& choices) {
    const double width = problem.output.width, height = problem.output.height, aspect = width / height;
    const auto middle = [](int side) { return 2.0 * (side / 2) / side - 1; };
    const double field =
        ray_length(1, 1, aspect) / ray_length(middle(problem.output.height), middle(problem.output.width), aspect);
    const double diagonal = std::hypot(width, height);
    const double exponent = 1 + 2 * std::min(1.0, diagonal / std::hypot(1080.0, 1920.0));
    KernelCall call = call_of("nss_guide", "guide", problem, choices);
    call.options = "-DGUIDE";
    add_tensor(call, "DEPTH", problem.inputs[0]);
    add_tensor(call, "MOTION", problem.inputs[1]);
    add_tensor(call, "BEFORE", problem.inputs[2]);
    add_tensor(call, "OUT", problem.output);
    add_number(call, "tolerance", static_cast<float>(kSeparation * field * diagonal));
    add_number(call, "exponent", static_cast<float>(exponent));
    pass_inputs(call, 0, 3);
    call.arguments.push_back({ArgumentKind::frame});
    return {std::move(call), std::nullopt};
}

Lowered lower_flicker(const Problem& problem, const Choices& choices) {
    KernelCall call = call_of("nss_input", "flicker", problem, choices);
    call.options = "-DFLICKER";
    add_images(call, {{"COLOR", problem.inputs[0]}, {"DERIVATIVE", problem.inputs[2]}, {"OUT", problem.output}});
    add_tensor(call, "GUIDE", problem.inputs[1]);
    pass_inputs(call, 0, 3);
    return {std::move(call), std::nullopt};
}

Lowered lower_input(const Problem& problem, const Choices& choices) {
    KernelCall call = call_of("nss_input", "network_input", problem, choices);
    add_images(call, {{"COLOR", problem.inputs[0]},
                      {"FLICKER", problem.inputs[2]},
                      {"HISTORY", problem.inputs[3]},
                      {"TEMPORAL", problem.inputs[4]},
                      {"OUT", problem.output}});
    add_tensor(call, "GUIDE", problem.inputs[1]);
    pass_inputs(call, 0, 5);
    call.arguments.push_back({ArgumentKind::frame});
    return {std::move(call), std::nullopt};
}

/// How an axis' samples lie in its output pixels; what is rounded, in single precision, is rounded as the gym does.
void add_axis(KernelCall& call, const std::string& axis, int low, int high) {
    const int divisor = std::gcd(low, high);
    const float scale = static_cast<float>(high) / static_cast<float>(low);
    add_number(call, "samples" + axis, low / divisor);
    add_number(call, "cells" + axis, high / divisor);
    add_number(call, "scale" + axis, scale);
    add_number(call, "inverse" + axis, 1 / scale);
}

Lowered lower_resolve(const Problem& problem, const Choices& choices) {
    KernelCall call = call_of("nss_resolve", "resolve", problem, choices);
    const TensorLayout& color = problem.inputs[0];
    call.options = fmt::format("-DWEIGHED={}", kWeighed);
    add_images(call, {{"COLOR", color},
                      {"KERNELS", problem.inputs[2]},
                      {"TEMPORAL", problem.inputs[3]},
                      {"HISTORY", problem.inputs[4]},
                      {"OUT", problem.output}});
    add_tensor(call, "GUIDE", problem.inputs[1]);
    add_axis(call, "_x", color.width, problem.output.width);
    add_axis(call, "_y", color.height, problem.output.height);
    pass_inputs(call, 0, 5);
    call.arguments.push_back({ArgumentKind::frame});
    return {std::move(call), std::nullopt};
}

constexpr int kLanes = 16;

int period_across(const Problem& problem) {
    const int low = problem.inputs[0].width, high = problem.output.width;
    return high / std::gcd(low, high);
}

int prefer_strips(const Problem& problem, const DeviceProfile& profile) {
    return !wants_many_work_items(profile) && period_across(problem) * kLanes <= problem.output.width ? 2 : 0;
}

Lowered lower_resolve_strips(const Problem& problem, const Choices& choices) {
    Lowered lowered = lower_resolve(problem, choices);
    lowered.call.entry = "resolve_strip";
    lowered.call.options += fmt::format(" -DLANES={}", kLanes);
    const int period = period_across(problem);
    lowered.call.global = strips(problem.output, kLanes * period, 1);
    lowered.call.global[0] *= period;
    return lowered;
}

}  // namespace

std::span<const Implementation> nss_far_implementations() {
    static const Implementation implementations[] = {{"far depth", obvious, group_choices, lower_far}};
    return implementations;
}

std::span<const Implementation> nss_scatter_implementations() {
    static const Implementation implementations[] = {{"scatter depth", obvious, group_choices, lower_scatter}};
    return implementations;
}

std::span<const Implementation> nss_guide_implementations() {
    static const Implementation implementations[] = {{"guide", obvious, group_choices, lower_guide}};
    return implementations;
}

std::span<const Implementation> nss_flicker_implementations() {
    static const Implementation implementations[] = {{"flicker", obvious, group_choices, lower_flicker}};
    return implementations;
}

std::span<const Implementation> nss_input_implementations() {
    static const Implementation implementations[] = {{"network input", obvious, group_choices, lower_input}};
    return implementations;
}

std::span<const Implementation> nss_resolve_implementations() {
    static const Implementation implementations[] = {
        {"resolve strips", prefer_strips, single_choices, lower_resolve_strips},
        {"resolve", obvious, group_choices, lower_resolve}};
    return implementations;
}

}  // namespace clarus::runtime
