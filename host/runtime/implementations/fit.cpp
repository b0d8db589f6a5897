#include <fmt/format.h>

#include "runtime/implementations/lowering.h"

namespace clarus::runtime {
namespace {

constexpr int kStripPixels = 64, kStripRows = 16;

Lowered lower_plain(const Problem& problem, const Choices& choices) {
    const TensorLayout &in = problem.inputs[0], &out = problem.output;
    KernelCall call;
    call.file = call.entry = "fit";
    call.options = fmt::format("-DENLARGES_X={:d} -DENLARGES_Y={:d} -DMOST_TAPS={}", out.width > in.width,
                               out.height > in.height, graph::kMostFitRatio + 1);
    add_images(call, {{"IN", in}, {"OUT", out}});
    call.arguments = {{ArgumentKind::input, 0}, {ArgumentKind::output}};
    call.global = pixels(out);
    call.local = group_size(choices);
    return {std::move(call), std::nullopt};
}

int prefer_strips(const Problem& problem, const DeviceProfile& profile) {
    const bool fits = problem.inputs[0].channels == 3 && has_quads(problem.inputs[0]) && problem.output.block == 1;
    return fits && profile.device_class != DeviceClass::gpu ? 2 : 0;
}

Lowered lower_strips(const Problem& problem, const Choices& choices) {
    Lowered lowered = lower_plain(problem, choices);
    lowered.call.entry = "fit_strip";
    lowered.call.options += fmt::format(" -DPIXELS={} -DROWS={}", kStripPixels, kStripRows);
    lowered.call.global = strips(problem.output, kStripPixels, kStripRows);
    return lowered;
}

}  // namespace

std::span<const Implementation> fit_implementations() {
    static const Implementation implementations[] = {{"fit strips", prefer_strips, single_choices, lower_strips},
                                                     {"fit", obvious, group_choices, lower_plain}};
    return implementations;
}

}  // namespace clarus::runtime
