#include <fmt/format.h>

#include "runtime/implementations/lowering.h"

namespace clarus::runtime {
namespace {

Lowered lower(const Problem& problem, const Choices& choices) {
    KernelCall call;
    call.file = call.entry = "sharpen";
    call.options = fmt::format("-DAMOUNT={:.9e}f", std::get<graph::Sharpen>(problem.node.op).amount);
    add_images(call, {{"IN", problem.inputs[0]}, {"OUT", problem.output}});
    call.arguments = {{ArgumentKind::input, 0}, {ArgumentKind::output}};
    call.global = pixels(problem.output);
    call.local = group_size(choices);
    return {std::move(call), std::nullopt};
}

}  // namespace

std::span<const Implementation> sharpen_implementations() {
    static const Implementation implementations[] = {{"sharpen", obvious, group_choices, lower}};
    return implementations;
}

}  // namespace clarus::runtime
