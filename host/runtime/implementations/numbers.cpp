#include <fmt/format.h>

#include "runtime/implementations/lowering.h"

namespace clarus::runtime {
namespace {

Lowered lower(const Problem& problem, const Choices& choices) {
    const graph::Quantization& quantization = std::get<graph::Numbers>(problem.node.op).quantization;
    KernelCall call;
    call.file = call.entry = "numbers";
    call.options = fmt::format("-DSTRIP={}", choices.at("STRIP"));
    add_images(call, {{"IN", problem.inputs[0]}});
    add_tensor(call, "OUT", problem.output);
    add_number(call, "inverse_scale", 1 / quantization.scale);
    add_number(call, "zero_point", quantization.zero_point);
    call.arguments = {{ArgumentKind::input, 0}, {ArgumentKind::output}};
    call.global = strips(problem.output, choices);
    call.local = group_size(choices);
    return {std::move(call), std::nullopt};
}

}  // namespace

std::span<const Implementation> numbers_implementations() {
    static const Implementation implementations[] = {{"numbers", obvious, strip_choices, lower}};
    return implementations;
}

}  // namespace clarus::runtime
