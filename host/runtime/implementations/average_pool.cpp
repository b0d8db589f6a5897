#include <fmt/format.h>

#include "runtime/implementations/lowering.h"

namespace clarus::runtime {
namespace {

Lowered lower(const Problem& problem, const Choices& choices) {
    KernelCall call;
    call.file = call.entry = "average_pool";
    call.options = fmt::format("-DSCALE={}", std::get<graph::AveragePool>(problem.node.op).scale);
    add_images(call, {{"IN", problem.inputs[0]}, {"OUT", problem.output}});
    call.arguments = {{ArgumentKind::input, 0}, {ArgumentKind::output}};
    call.global = pixels(problem.output);
    call.local = group_size(choices);
    return {std::move(call), std::nullopt};
}

}  // namespace

std::span<const Implementation> average_pool_implementations() {
    static const Implementation implementations[] = {{"average pool", obvious, group_choices, lower}};
    return implementations;
}

}  // namespace clarus::runtime
