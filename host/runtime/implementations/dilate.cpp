#include <fmt/format.h>

#include "runtime/implementations/lowering.h"

namespace clarus::runtime {
namespace {

Lowered lower(const Problem& problem, const Choices& choices) {
    const TensorLayout& depth = problem.inputs[1];
    KernelCall call;
    call.file = call.entry = "dilate";
    call.options = fmt::format("{} {} {} -DSCALE={}", image_options({{"DEPTH", depth}}),
                               layout_options("MOTION", problem.inputs[0]), layout_options("OUT", problem.output),
                               std::get<graph::Dilate>(problem.node.op).scale);
    call.arguments = {{ArgumentKind::input, 0}, {ArgumentKind::input, 1}, {ArgumentKind::output}};
    call.global = pixels(problem.output);
    call.local = group_size(choices);
    return {std::move(call), std::nullopt};
}

}  // namespace

std::span<const Implementation> dilate_implementations() {
    static const Implementation implementations[] = {{"dilate", obvious, group_choices, lower}};
    return implementations;
}

}  // namespace clarus::runtime
