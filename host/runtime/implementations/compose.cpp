#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "runtime/implementations/lowering.h"

namespace clarus::runtime {
namespace {

constexpr int kLanes = 16, kRows = 16;

double scale_of(const Problem& problem) { return std::get<graph::Compose>(problem.node.op).scale; }

Lowered lower_plain(const Problem& problem, const Choices& choices) {
    KernelCall call;
    call.file = call.entry = "compose";
    call.options = fmt::format("{} {} {}",
                               image_options({{"COLOR", problem.inputs[0]},
                                              {"PAST", problem.inputs[1]},
                                              {"PARAMETERS", problem.inputs[2]},
                                              {"OUT", problem.output}}),
                               scale_options(scale_of(problem)), shift_options(graph::Shift::jitter));
    call.arguments = {{ArgumentKind::input, 0},
                      {ArgumentKind::input, 1},
                      {ArgumentKind::input, 2},
                      {ArgumentKind::output},
                      {ArgumentKind::frame}};
    call.global = pixels(problem.output);
    call.local = group_size(choices);
    return {std::move(call), std::nullopt};
}

// --- lanes: sixteen samples' pixels as one vector

int prefer_lanes(const Problem& problem, const DeviceProfile& profile) {
    const bool fits = problem.output.block == 1 && std::all_of(problem.inputs.begin(), problem.inputs.end(),
                                                               [](const TensorLayout& in) { return in.block == 1; });
    return fits && !wants_many_work_items(profile) ? 2 : 0;
}

Lowered lower_lanes(const Problem& problem, const Choices& choices) {
    Lowered lowered = lower_plain(problem, choices);
    lowered.call.entry = "compose_lanes";
    lowered.call.options +=
        fmt::format(" -DROWS={} -DPHASES={}", kRows, static_cast<int>(std::ceil(scale_of(problem))));
    lowered.call.global = strips(problem.inputs[0], kLanes, kRows);
    return lowered;
}

}  // namespace

std::span<const Implementation> compose_implementations() {
    static const Implementation implementations[] = {{"compose lanes", prefer_lanes, single_choices, lower_lanes},
                                                     {"compose", obvious, group_choices, lower_plain}};
    return implementations;
}

}  // namespace clarus::runtime
