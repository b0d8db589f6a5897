#include <fmt/format.h>

#include "base/rounding.h"
#include "runtime/implementations/lowering.h"

namespace clarus::runtime {
namespace {

KernelCall call_for(const Problem& problem, const Choices& choices, std::string entry) {
    KernelCall call;
    call.file = "fsr1";
    call.entry = std::move(entry);
    add_images(call, {{"IN", problem.inputs[0]}, {"OUT", problem.output}});
    call.arguments = {{ArgumentKind::input, 0}, {ArgumentKind::output}};
    call.global = pixels(problem.output);
    call.local = group_size(choices);
    return call;
}

Lowered lower_easu(const Problem& problem, const Choices& choices) {
    KernelCall call = call_for(problem, choices, "easu");
    add_scale(call, std::get<graph::Easu>(problem.node.op).scale);
    call.arguments.push_back({ArgumentKind::frame});
    return {std::move(call), std::nullopt};
}

Lowered lower_rcas(const Problem& problem, const Choices& choices) {
    KernelCall call = call_for(problem, choices, "rcas");
    call.options += fmt::format(" -DSHARPNESS={:.9e}f", std::get<graph::Rcas>(problem.node.op).sharpness);
    return {std::move(call), std::nullopt};
}

int prefer_strips(const Problem& problem, const DeviceProfile& profile) {
    const bool fits = has_quads(problem.inputs[0]) && problem.output.block == 1;
    return fits && profile.device_class != DeviceClass::gpu ? 2 : 0;
}

Lowered lower_easu_cells(const Problem& problem, const Choices& choices) {
    constexpr int kCells = 64, kRows = 16;
    const TensorLayout& in = problem.inputs[0];
    Lowered lowered = lower_easu(problem, choices);
    lowered.call.entry = "easu_cells";
    lowered.call.options += fmt::format(" -DROWS={}", kRows);
    // One more of them than texels along each axis: before the first, too. Jitter and rounding may add one.
    lowered.call.global = {static_cast<size_t>(ceil_divide(in.width + 2, kCells)),
                           static_cast<size_t>(ceil_divide(in.height + 2, kRows))};
    return lowered;
}

Lowered lower_rcas_strips(const Problem& problem, const Choices& choices) {
    constexpr int kPixels = 256, kRows = 16;
    Lowered lowered = lower_rcas(problem, choices);
    lowered.call.entry = "rcas_strip";
    lowered.call.options += fmt::format(" -DPIXELS={} -DROWS={}", kPixels, kRows);
    lowered.call.global = strips(problem.output, kPixels, kRows);
    return lowered;
}

}  // namespace

std::span<const Implementation> easu_implementations() {
    static const Implementation implementations[] = {{"easu cells", prefer_strips, single_choices, lower_easu_cells},
                                                     {"easu", obvious, group_choices, lower_easu}};
    return implementations;
}

std::span<const Implementation> rcas_implementations() {
    static const Implementation implementations[] = {{"rcas strips", prefer_strips, single_choices, lower_rcas_strips},
                                                     {"rcas", obvious, group_choices, lower_rcas}};
    return implementations;
}

}  // namespace clarus::runtime
