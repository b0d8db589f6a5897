#include <fmt/format.h>

#include "runtime/implementations/lowering.h"

namespace clarus::runtime {
namespace {

Lowered lower(const Problem& problem, const Choices& choices) {
    KernelCall call;
    call.file = call.entry = "max_pool";
    call.options = fmt::format("-DSTRIP={}", choices.at("STRIP"));
    add_images(call, {{"IN", problem.inputs[0]}, {"OUT", problem.output}});
    call.arguments = {{ArgumentKind::input, 0}, {ArgumentKind::output}};
    call.global = strips(problem.output, choices);
    call.local = group_size(choices);
    return {std::move(call), std::nullopt};
}

}  // namespace

std::span<const Implementation> max_pool_implementations() {
    static const Implementation implementations[] = {{"max pool", obvious, strip_choices, lower}};
    return implementations;
}

}  // namespace clarus::runtime
