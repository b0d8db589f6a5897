#include "runtime/implementations/lowering.h"

namespace clarus::runtime {
namespace {

Lowered lower(const Problem& problem, const Choices& choices) {
    KernelCall call;
    call.file = call.entry = "max_pool";
    call.options = image_options({{"IN", problem.inputs[0]}, {"OUT", problem.output}});
    call.arguments = {{ArgumentKind::input, 0}, {ArgumentKind::output}};
    call.global = pixels(problem.output);
    call.local = group_size(choices);
    return {std::move(call), std::nullopt};
}

}  // namespace

std::span<const Implementation> max_pool_implementations() {
    static const Implementation implementations[] = {{"max pool", obvious, group_choices, lower}};
    return implementations;
}

}  // namespace clarus::runtime
