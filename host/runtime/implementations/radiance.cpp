#include <fmt/format.h>

#include "runtime/implementations/lowering.h"

namespace clarus::runtime {
namespace {

Lowered lower(const Problem& problem, const Choices& choices) {
    const auto* radiance = std::get_if<graph::Radiance>(&problem.node.op);
    const double white = radiance ? radiance->white : std::get<graph::Display>(problem.node.op).white;
    KernelCall call;
    call.file = call.entry = "radiance";
    call.options = fmt::format("-DFOLD={:.9e}f -D{}", 1 - 1 / white, radiance ? "DECODE" : "ENCODE");
    add_images(call, {{"IN", problem.inputs[0]}, {"OUT", problem.output}});
    call.arguments = {{ArgumentKind::input, 0}, {ArgumentKind::output}};
    call.global = strips(problem.output, 4, 1);
    call.local = group_size(choices);
    return {std::move(call), std::nullopt};
}

}  // namespace

std::span<const Implementation> radiance_implementations() {
    static const Implementation implementations[] = {{"radiance", obvious, group_choices, lower}};
    return implementations;
}

}  // namespace clarus::runtime
