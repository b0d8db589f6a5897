#include <fmt/format.h>

#include "runtime/implementations/lowering.h"

namespace clarus::runtime {
namespace {

Lowered lower(const Problem& problem, const Choices& choices, std::string entry, int samples, int scale,
              const TensorLayout& grid) {
    KernelCall call;
    call.file = "samples";
    call.entry = std::move(entry);
    call.options = fmt::format("-DSCALE={}", scale);
    add_images(call, {{"IN", problem.inputs[samples]}, {"OUT", problem.output}});
    call.arguments = {{ArgumentKind::input, samples}, {ArgumentKind::output}, {ArgumentKind::frame}};
    call.global = pixels(grid);
    call.local = group_size(choices);
    return {std::move(call), std::nullopt};
}

Lowered lower_pick(const Problem& problem, const Choices& choices) {
    return lower(problem, choices, "pick", 0, std::get<graph::Pick>(problem.node.op).scale, problem.output);
}

Lowered lower_place(const Problem& problem, const Choices& choices) {
    return lower(problem, choices, "place", 1, std::get<graph::Place>(problem.node.op).scale, problem.inputs[1]);
}

}  // namespace

std::span<const Implementation> pick_implementations() {
    static const Implementation implementations[] = {{"pick", obvious, group_choices, lower_pick}};
    return implementations;
}

std::span<const Implementation> place_implementations() {
    static const Implementation implementations[] = {{"place", obvious, group_choices, lower_place}};
    return implementations;
}

}  // namespace clarus::runtime
