#include <fmt/format.h>

#include "runtime/implementations/lowering.h"

namespace clarus::runtime {
namespace {

Lowered lower(const Problem& problem, const Choices& choices) {
    const TensorLayout& depth = problem.inputs[1];
    KernelCall call;
    call.file = call.entry = "dilate";
    call.options =
        fmt::format("-DSCALE={} -DSTRIP={}", std::get<graph::Dilate>(problem.node.op).scale, choices.at("STRIP"));
    add_images(call, {{"DEPTH", depth}});
    add_tensor(call, "MOTION", problem.inputs[0]);
    add_tensor(call, "OUT", problem.output);
    call.arguments = {{ArgumentKind::input, 0}, {ArgumentKind::input, 1}, {ArgumentKind::output}};
    call.global = strips(problem.output, choices);
    call.local = group_size(choices);
    return {std::move(call), std::nullopt};
}

}  // namespace

std::span<const Implementation> dilate_implementations() {
    static const Implementation implementations[] = {{"dilate", obvious, strip_choices, lower}};
    return implementations;
}

}  // namespace clarus::runtime
