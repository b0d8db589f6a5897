#include <fmt/format.h>

#include "runtime/implementations/lowering.h"

namespace clarus::runtime {
namespace {

Lowered lower_plain(const Problem& problem, const Choices& choices) {
    KernelCall call;
    call.file = call.entry = "warp_sharply";
    call.options = fmt::format(
        "{} {} {} -DSTRIP={}",
        image_options({{"IMAGE", problem.inputs[0]}, {"COLOR", problem.inputs[2]}, {"OUT", problem.output}}),
        layout_options("MOTION", problem.inputs[1]), scale_options(std::get<graph::WarpSharply>(problem.node.op).scale),
        choices.at("STRIP"));
    call.arguments = {{ArgumentKind::input, 0},
                      {ArgumentKind::input, 1},
                      {ArgumentKind::input, 2},
                      {ArgumentKind::output},
                      {ArgumentKind::frame}};
    call.global = strips(problem.output, choices);
    call.local = group_size(choices);
    return {std::move(call), std::nullopt};
}

}  // namespace

std::span<const Implementation> warp_sharply_implementations() {
    static const Implementation implementations[] = {{"warp sharply", obvious, strip_choices, lower_plain}};
    return implementations;
}

}  // namespace clarus::runtime
