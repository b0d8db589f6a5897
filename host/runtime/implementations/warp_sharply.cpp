#include <fmt/format.h>

#include "runtime/implementations/lowering.h"

namespace clarus::runtime {
namespace {

Lowered lower_plain(const Problem& problem, const Choices& choices) {
    KernelCall call;
    call.file = call.entry = "warp_sharply";
    call.options = fmt::format("-DSTRIP={}", choices.at("STRIP"));
    add_images(call, {{"IMAGE", problem.inputs[0]}, {"COLOR", problem.inputs[2]}, {"OUT", problem.output}});
    add_tensor(call, "MOTION", problem.inputs[1]);
    add_scale(call, std::get<graph::WarpSharply>(problem.node.op).scale);
    call.arguments = {{ArgumentKind::input, 0},
                      {ArgumentKind::input, 1},
                      {ArgumentKind::input, 2},
                      {ArgumentKind::output},
                      {ArgumentKind::frame}};
    call.global = strips(problem.output, choices);
    call.local = group_size(choices);
    return {std::move(call), std::nullopt};
}

// --- lanes: the weights of sixteen pixels as vectors

int prefer_lanes(const Problem& problem, const DeviceProfile& profile) {
    return has_quads(problem.inputs[0]) && !wants_many_work_items(profile) ? 2 : 0;
}

Lowered lower_lanes(const Problem& problem, const Choices& choices) {
    constexpr int kPixels = 64;
    Lowered lowered = lower_plain(problem, choices);
    lowered.call.entry = "warp_sharply_lanes";
    lowered.call.options += fmt::format(" -DPIXELS={}", kPixels);
    lowered.call.global = strips(problem.output, kPixels, 1);
    return lowered;
}

std::vector<Choices> lanes_choices(const Problem&, const DeviceProfile&) {
    return {{{"WG_X", 1}, {"WG_Y", 1}, {"STRIP", 1}}};
}

}  // namespace

std::span<const Implementation> warp_sharply_implementations() {
    static const Implementation implementations[] = {{"warp lanes", prefer_lanes, lanes_choices, lower_lanes},
                                                     {"warp sharply", obvious, strip_choices, lower_plain}};
    return implementations;
}

}  // namespace clarus::runtime
